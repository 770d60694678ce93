// The page: its parts, one concern a file. A file panel_NAME.js beside this one is a panel, and is loaded before this.
import { tell } from "/page/bus.js";
import "/page/words.js";
import "/page/figures.js";
import "/page/chart.js";
import "/page/readout.js";
import "/page/residual_panel.js";
import "/page/measured_range.js";
import "/page/export_files.js";
import "/page/dragging.js";
import "/page/picture_view.js";
import "/page/overlay.js";
import "/page/magnifier.js";
import "/page/actions.js";
import "/page/keys.js";
import "/page/dropped_files.js";
import "/page/viewers.js";
import "/page/socket.js";
tell("start");

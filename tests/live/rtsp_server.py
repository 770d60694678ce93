"""An RTSP camera on loopback, for the system's Python, which has GStreamer's bindings.

Arguments: PORT, a pattern of JPEGs, their count, the coder (jpeg, h264, or frames: H.264 that loses whole pictures
before they are put into packets), and the share of packets that get lost.
"""

import sys

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402 - the versions come first

PORT, PICTURES, COUNT, CODER, LOST = sys.argv[1:]
# RTP's payload for JPEG knows no grey pictures: colour at half resolution it is.
CODED = {
    "jpeg": "jpegenc quality=95 ! rtpjpegpay pt=26",
    "frames": f"openh264enc gop-size=12 bitrate=4000000 ! h264parse ! identity drop-probability={LOST} "
    "! rtph264pay pt=96 config-interval=-1",
    "h264": "openh264enc gop-size=12 bitrate=4000000 ! h264parse ! rtph264pay pt=96 config-interval=-1",
}
WHOLE = {name: f"{coded} name=pay0" for name, coded in CODED.items()}
# What stands behind the payloader loses packets as a network does: their sequence numbers are missing.
NETWORK = f"{CODED[CODER]} ! identity name=pay0 drop-probability={LOST}"
PAYLOAD = NETWORK if float(LOST) and CODER != "frames" else WHOLE[CODER]
PIPELINE = (
    f'( multifilesrc location="{PICTURES}" stop-index={int(COUNT) - 1} loop=true caps="image/jpeg,framerate=25/1" '
    f"! jpegdec ! videoconvert ! video/x-raw,format=I420 ! {PAYLOAD} )"
)

Gst.init(None)
server = GstRtspServer.RTSPServer()
server.set_address("127.0.0.1")
server.set_service(PORT)
factory = GstRtspServer.RTSPMediaFactory()
factory.set_launch(PIPELINE)
server.get_mount_points().add_factory("/camera", factory)
server.attach(None)
GLib.MainLoop().run()

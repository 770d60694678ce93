"""An RTSP camera on loopback, for the system's Python, which has GStreamer's bindings: PORT, and a pattern of JPEGs."""

import sys

import gi

gi.require_version("Gst", "1.0")
gi.require_version("GstRtspServer", "1.0")
from gi.repository import GLib, Gst, GstRtspServer  # noqa: E402 - the versions come first

PORT, PICTURES, COUNT = sys.argv[1:]
# RTP's payload for JPEG knows no grey pictures: colour at half resolution it is.
PIPELINE = (
    f'( multifilesrc location="{PICTURES}" stop-index={int(COUNT) - 1} loop=true caps="image/jpeg,framerate=25/1" '
    "! jpegdec ! videoconvert ! video/x-raw,format=I420 ! jpegenc quality=95 ! rtpjpegpay name=pay0 pt=26 )"
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

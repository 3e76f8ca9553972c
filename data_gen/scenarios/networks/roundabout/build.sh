#!/bin/sh
# Makes network.net.xml; see ../build_network.sh.
exec "$(dirname "$0")/../build_network.sh" "$(dirname "$0")" roundabout

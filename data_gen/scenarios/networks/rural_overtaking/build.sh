#!/bin/sh
# Makes network.net.xml from the node and edge files beside this script.
# Needs netconvert, which `pip install eclipse-sumo` brings; users of the package need neither.
# The origin must stay where the node file puts it (offset normalization off): the camera looks at those coordinates.
set -eu
cd "$(dirname "$0")"
"${NETCONVERT:-netconvert}" --node-files rural.nod.xml --edge-files rural.edg.xml --output-file network.net.xml \
    --opposites.guess true --opposites.guess.fix-lengths true --offset.disable-normalization true \
    --no-turnarounds true --xml-validation never --output.street-names false
# netconvert writes the date and the full paths of its files into a comment: not wanted in a shipped file.
sed -i '/<!--/,/-->/d' network.net.xml

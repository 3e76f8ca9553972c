#!/bin/sh
# Makes FOLDER/network.net.xml from the sources in FOLDER (NAME.nod.xml, NAME.edg.xml and, where there are, NAME.con.xml
# and NAME.tll.xml); further arguments go to netconvert. Called by each scenario's build.sh.
# Needs netconvert, which `pip install eclipse-sumo` brings; users of the package need neither.
# The origin must stay where the node file puts it (offset normalization off): the camera looks at those coordinates.
set -eu
cd "$1"
name="$2"
shift 2
[ -f "$name.con.xml" ] && set -- --connection-files "$name.con.xml" "$@"
[ -f "$name.tll.xml" ] && set -- --tllogic-files "$name.tll.xml" "$@"
"${NETCONVERT:-netconvert}" --node-files "$name.nod.xml" --edge-files "$name.edg.xml" --output-file network.net.xml \
    --offset.disable-normalization true --no-turnarounds true --xml-validation never --output.street-names false "$@"
# netconvert writes the date and the full paths of its files into a comment: not wanted in a shipped file.
sed -i '/<!--/,/-->/d' network.net.xml

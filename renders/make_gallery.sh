#!/usr/bin/env bash
# Draws the pictures of renders/gallery into the current folder, with the program of build/release: renders/make_gallery.sh
# Needs chromium and ImageMagick for the pictures that are cut from pages.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
dexcheck=$root/build/release/bin/dexcheck
still() { "$dexcheck" render "$@" --size 800x450; }

"$dexcheck" run paper --video --out runs/seen
still runs/seen --still 5 --inset object --forces --out paper.png
still runs/seen --still 9.5 --camera course --out course.png
"$dexcheck" run reorient --set duration=3 --out runs/rolled
still runs/rolled --still 2.6 --camera grasp --forces --out reorient.png
"$dexcheck" run lift --out runs/lifted
still runs/lifted --still 13 --inset object --forces --out lift.png
"$dexcheck" run two-hands --out runs/carried
still runs/carried --still 8.5 --inset grasp --out two-hands.png

# laws.png is cut from the page of a study.
"$dexcheck" study run laws --db laws.sqlite
"$dexcheck" study report laws.sqlite --page laws.html
chromium --headless --hide-scrollbars --window-size=1180,3000 --screenshot=page.png laws.html
convert page.png -crop 1160x500+10+975 +repage -colors 64 laws.png

# two-files.png is cut from the page of a Panda and a copy with three errors; consistency ends with exit code 1.
sed -e 's/joint name="panda_joint6"/& axis="0 0 -1"/; s/pos="0.027518 0.039252/pos="0.027518 0.089252/; s/-0.0825 0.384/-0.0825 0.424/' \
  "$root/mjcf/panda.xml" >panda.xml
"$dexcheck" "$root/controller/parameters/panda.toml" panda.xml --page two-files.html || [[ $? -eq 1 ]]
chromium --headless --hide-scrollbars --window-size=1180,760 --screenshot=page.png two-files.html
convert page.png -crop 1180x745+0+0 +repage -resize 1000x -colors 64 two-files.png

# judge.png is cut from the page of a recording with added friction in joint 4; judge ends with exit code 1.
"$dexcheck" run panda-reach --out runs/reach
"$dexcheck" export runs/reach --csv - --signals time,q,xi,tau |
  awk -F, -v OFS=, 'NR > 1 { $19 += ($12 > 0 ? 0.4 : -0.4) + 0.2 * $12 } 1' >recording.csv
"$dexcheck" judge "$root/controller/parameters/panda.toml" recording.csv --page judge.html || [[ $? -eq 1 ]]
chromium --headless --window-size=1100,3400 --screenshot=page.png judge.html
convert page.png -crop 1085x1480+0+0 +repage -resize 900x -colors 128 judge.png

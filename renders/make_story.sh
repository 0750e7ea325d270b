#!/usr/bin/env bash
# Draws the story video of the README: renders/make_story.sh DEXCHECK OUT.gif [FOLDER with runs lift and curve]
# Approach, grasp, lift, a curve, the verdict: 20 s. Needs ffmpeg and DejaVu fonts.
set -euo pipefail

dexcheck=$1
out=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
runs=${3:-$work}
for scenario in lift curve; do
  [[ -e $runs/$scenario/log.h5 ]] || "$dexcheck" run "$scenario" --no-report --quiet --out "$runs/$scenario"
done
size=480x270
fps=10
render() { "$dexcheck" render "$runs/$1" --size "$size" --fps "$fps" --no-panel --quiet --out "$work/$2.mp4" "${@:3}"; }
render lift wide --camera overview
render lift near --camera grasp --forces
render curve curve --camera overview --tracks

font=/usr/share/fonts/truetype/dejavu/DejaVuSans-Bold.ttf
# cut NAME FILM FROM TO SPEED CAPTION: a piece of a video, faster, with a caption.
cut() {
  ffmpeg -loglevel error -y -ss "$3" -to "$4" -i "$work/$2.mp4" -an -crf 12 -vf "setpts=PTS/$5,fps=$fps,drawtext=fontfile=$font:text='$6':\
x=14:y=h-32:fontsize=16:fontcolor=white:box=1:boxcolor=black@0.55:boxborderw=7" "$work/$1.mp4"
}
cut 1 wide 1.4 6.5 1.7 'The hand comes near'
cut 2 near 5.4 9.9 0.9 'Four fingertips take hold, forces in their cones'
cut 3 wide 9.5 16.5 1.75 'It lifts and carries'
cut 4 curve 2 12 2 'It drives a curve, wheels rolling, fingers holding'
verdict=$("$dexcheck" run --replay "$runs/curve" --quiet | head -1)
[[ $verdict == IDENTICAL* ]] || { echo "make_story: the run of curve does not replay: $verdict" >&2; exit 1; }
grep -q '"verdict": "pass"' "$runs/curve/summary.json" || { echo "make_story: curve does not pass" >&2; exit 1; }
ffmpeg -loglevel error -y -sseof -0.2 -i "$work/4.mp4" -frames:v 1 -update 1 "$work/last.png"
ffmpeg -loglevel error -y -loop 1 -t 3 -i "$work/last.png" -crf 12 -vf "fps=$fps,drawbox=color=0x0b2a1e@0.78:t=fill,drawtext=fontfile=$font:\
text='PASS':x=(w-tw)/2:y=78:fontsize=58:fontcolor=0x5fd3a5,drawtext=fontfile=$font:text='model, law, inverse and forward dynamics, assumptions':\
x=(w-tw)/2:y=160:fontsize=16:fontcolor=white,drawtext=fontfile=$font:text='checked against MuJoCo at each of 12000 steps':x=(w-tw)/2:y=188:\
fontsize=16:fontcolor=white,format=yuv420p" "$work/5.mp4"
for i in 1 2 3 4 5; do echo "file '$work/$i.mp4'"; done >"$work/list"
ffmpeg -loglevel error -y -f concat -safe 0 -i "$work/list" -vf "fps=$fps,split[a][b];[a]palettegen=max_colors=128:stats_mode=diff[p];\
[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle" -loop 0 "$out"
ls -l "$out"

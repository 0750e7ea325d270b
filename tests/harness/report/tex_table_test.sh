#!/usr/bin/env bash
# LaTeX makes a page of the table of a run whose command has all that LaTeX treats specially: tex_table_test.sh DEXCHECK PDFLATEX
set -euo pipefail

scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
cd "$scratch"
export HOME=$scratch  # where LaTeX keeps fonts
kpsewhich booktabs.sty >/dev/null || { echo "skipped, not found: texlive-latex-recommended"; exit 77; }
run='50%_{a}&b#c^2~$d\e'
"$1" run hold --set duration=0.02 --out "$run" --no-report --quiet >/dev/null
"$1" report "$run" --no-replay --tex results.tex --quiet
cat >paper.tex <<'TEX'
\documentclass{article}
\usepackage{booktabs}
\begin{document}
\input{results.tex}
\end{document}
TEX
"$2" -halt-on-error -interaction=nonstopmode paper.tex >log.txt || { tail -30 log.txt; exit 1; }
if command -v pdftotext >/dev/null; then
  pdftotext -layout paper.pdf
  for word in 'dexcheck run hold' 'position error max' 'cone use' 'law (1' commit '&b#c'; do
    grep -qF "$word" paper.txt || { cat paper.txt; echo "the page lacks: $word"; exit 1; }
  done
fi
# It can fail.
sed -i 's/\\bottomrule/\\notarule/' results.tex
! "$2" -halt-on-error -interaction=nonstopmode paper.tex >log.txt

#!/usr/bin/env bash
# Checks the documents: documents_test.sh DEXCHECK. Relative links of all Markdown files lead to files and headings that
# exist, README.md is short, the commands that it lists are those that the program has, and sentences are short.
set -euo pipefail

dexcheck=$1
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
longest_readme=150  # lines
status=0
fail() {
  echo "$*"
  status=1
}

# The anchors that a document's headings get: lower case, without punctuation, hyphens for spaces.
list_anchors() {
  awk '/^```/ { code = !code } !code && /^#+ / { sub(/^#+ +/, ""); print }' "$1" |
    tr '[:upper:]' '[:lower:]' | sed -E 's/[^a-z0-9 _-]//g; s/ /-/g'
}

# Targets of links and pictures outside code.
list_links() {
  awk '/^```/ { code = !code } !code' "$1" | sed 's/`[^`]*`//g' | grep -oE '\]\([^)]+\)' | sed -E 's/^\]\(|\)$//g' || true
}

# Prints each broken link of a document.
list_broken_links() {
  local document=$1 link file anchor
  while IFS= read -r link; do
    [[ $link != *://* && $link != mailto:* && -n $link ]] || continue
    file=$(dirname "$document")/${link%%#*}
    [[ $link != '#'* ]] || file=$document
    anchor=
    [[ $link != *'#'* ]] || anchor=${link#*#}
    if [[ ! -e $file ]]; then
      echo "$document: $link: no such file"
    elif [[ -n $anchor ]] && ! list_anchors "$file" | grep -xF -- "$anchor" >/dev/null; then
      echo "$document: $link: no such heading"
    fi
  done < <(list_links "$document")
}

# Lines that git leaves where it could not merge.
list_conflicts() { grep -nE '^(<{7}|={7}|>{7}|\|{7})( |$)' /dev/null "$@" || true; }

# The length in words of each sentence outside code, tables and headings; items of a list are sentences.
list_sentences() {
  awk '/^```/ { code = !code; print "\n"; next } code || /^    / { next } /^[|#]/ || NF == 0 { print "\n"; next }
    { sub(/^ *([-*]|[0-9]+\.) /, "\n"); gsub(/\]\([^)]*\)/, "]"); gsub(/[.!?:] /, "&\n"); print }' "$@" |
    awk 'NF == 0 { if (words > 2) print words; words = 0; next } { words += NF } /[.!?:][)"*]* *$/ { if (words > 2) print words
      words = 0 } END { if (words > 2) print words }'
}

# What must be found: the test can fail.
scratch=$(mktemp -d)
trap 'rm -r "$scratch"' EXIT
printf 'a\n<<''<<<<< HEAD\nb\n===''====\nc\n>>''>>>>> merge\n' >"$scratch/conflict.md"
[[ $(list_conflicts "$scratch/conflict.md" | wc -l) -eq 3 ]] || fail "conflicts are not found"
printf '# Here\n[a](b.md) [c](#there) [d](#here) [e](https://nowhere.example)\n' >"$scratch/bad.md"
[[ $(list_broken_links "$scratch/bad.md" | wc -l) -eq 2 ]] || fail "broken links are not found"

printf 'A sentence of %s\nwords. And three more.\n' "$(seq -s ' ' 33)" >"$scratch/long.md"
[[ $(list_sentences "$scratch/long.md" | tr '\n' ' ') == '37 3 ' ]] || fail "lengths of sentences are wrong"

mapfile -t documents < <(find "$root" -name '*.md' -not -path "$root/build/*" -not -path "$root/runs/*" \
  -not -path "$root/out/*" -not -path "$root/.cache/*" | sort)
[[ ${#documents[@]} -gt 10 ]] || fail "only ${#documents[@]} documents are found in $root"
links=0
for document in "${documents[@]}"; do
  broken=$(list_broken_links "$document")
  [[ -z $broken ]] || fail "$broken"
  links=$((links + $(list_links "$document" | wc -l)))
done
[[ $links -gt 50 ]] || fail "only $links links are found"

conflicts=$(list_conflicts "${documents[@]}")
[[ -z $conflicts ]] || fail "$conflicts"

read -r mean longest < <(list_sentences "${documents[@]}" |
  awk '{ sum += $1; if ($1 > most) most = $1 } END { printf "%.1f %d\n", sum / NR, most }')
((longest <= 35)) || fail "the longest sentence has $longest words, more than 35"
awk -v mean="$mean" 'BEGIN { exit !(mean > 5 && mean <= 16) }' || fail "a sentence has $mean words on average, more than 16"
words=$(cat "${documents[@]}" | wc -w)
((words <= 25000)) || fail "the documents have $words words, more than 25,000"

lines=$(wc -l <"$root/README.md")
((lines <= longest_readme)) || fail "README.md has $lines lines, more than $longest_readme"

# Rows of the table of commands against the subcommands that --help lists.
sed -nE 's/^\| `dexcheck ([a-z-]+)` .*/\1/p' "$root/README.md" | sort >"$scratch/listed"
"$dexcheck" --help | sed -nE '/^Compare descriptions:/,$ s/^  ([a-z-]+) .*/\1/p' | sort >"$scratch/known"
[[ $(wc -l <"$scratch/known") -ge 5 ]] || fail "dexcheck --help lists no commands"
diff "$scratch/listed" "$scratch/known" >"$scratch/difference" ||
  fail "README.md (<) and dexcheck --help (>) have other commands:"$'\n'"$(cat "$scratch/difference")"

[[ $status -ne 0 ]] || echo "${#documents[@]} documents, $links links, $words words, $mean a sentence, $lines lines of README.md"
exit $status

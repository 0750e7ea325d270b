#!/usr/bin/env python3
"""Draws renders/gallery/terminal.svg, an animated terminal in which two files differ, one is repaired, and they agree:
renders/make_terminal.py [DEXCHECK]

Commands run in a pseudo-terminal, so that the picture shows their own words and colours.
"""

import html
import os
import pty
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CASES = ROOT / "harness/descriptions/examples/field_cases"
FILES = ("about_origin.urdf", "arm.xml")
COMMANDS = ("dexcheck about_origin.urdf arm.xml --quiet",
            "dexcheck diagnose about_origin.urdf arm.xml --write fixed.urdf --quiet",
            "dexcheck fixed.urdf arm.xml --quiet")
COLORS = {"31": "#ff7b72", "32": "#56d364", "33": "#e3b341", "36": "#79c0ff"}
PLAIN, PROMPT, BACKGROUND = "#c9d1d9", "#8b949e", "#0d1117"
COLUMNS, CHARACTER, LINE, EDGE = 80, 8.43, 20, 16  # the last three in pixels
TYPE_S, ANSWER_S, READ_S, CYCLE_S = 0.6, 0.3, 1.8, 10.0


def run(command, program, folder):
    """Runs a command of dexcheck in a terminal of 80 columns. Returns its lines, with colours."""
    parent, child = pty.openpty()
    os.set_blocking(parent, True)
    environment = {**os.environ, "COLUMNS": str(COLUMNS), "TERM": "xterm"}
    process = subprocess.Popen([program, *command.split()[1:]], cwd=folder, stdin=child, stdout=child, stderr=child,
                               env=environment)
    os.close(child)
    text = b""
    try:
        while part := os.read(parent, 4096):
            text += part
    except OSError:  # the terminal is closed when the program ends
        pass
    process.wait()
    os.close(parent)
    return text.decode().replace("\r", "").rstrip("\n").split("\n")


def draw_line(text):
    """The tspans of a line with ANSI colours."""
    color, spans = PLAIN, []
    for code, piece in re.findall(r"(?:\x1b\[([\d;]*)m)?([^\x1b]*)", text):
        for part in code.split(";"):
            color = COLORS.get(part, PLAIN if part in ("0", "") and code else color)
        if piece:
            spans.append(f'<tspan fill="{color}">{html.escape(piece)}</tspan>')
    return "".join(spans)


def main():
    program = str(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build/release/bin/dexcheck").resolve())
    rows, at = [], 0.4  # (seconds, spans)
    with tempfile.TemporaryDirectory() as folder:
        for name in FILES:
            shutil.copy(CASES / name, folder)
        for command in COMMANDS:
            rows.append((at, f'<tspan fill="{PROMPT}">$ </tspan><tspan fill="{PLAIN}">{html.escape(command)}</tspan>'))
            answers = run(command, program, folder)
            rows += [(at + TYPE_S + ANSWER_S, draw_line(line)) for line in answers] + [(at, "")]
            at += TYPE_S + ANSWER_S + READ_S
    width, height = 2 * EDGE + COLUMNS * CHARACTER, 2 * EDGE + LINE * (len(rows) - 1)
    styles, texts = [], []
    for start in sorted({start for start, _ in rows}):
        name = f"t{round(1000 * start)}"
        begin = 100 * start / CYCLE_S
        styles.append(f"@keyframes {name}{{0%,{begin:.2f}%{{opacity:0}}{begin + 0.01:.2f}%,100%{{opacity:1}}}}"
                      f".{name}{{animation:{name} {CYCLE_S:g}s infinite}}")
    for i, (start, spans) in enumerate(rows):
        if spans:
            texts.append(f'<text class="t{round(1000 * start)}" x="{EDGE}" y="{EDGE + LINE * (i + 0.75):g}" '
                         f'xml:space="preserve">{spans}</text>')
    (ROOT / "renders/gallery/terminal.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}" '
        f'font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="14">\n<style>{"".join(styles)}'
        f"@media (prefers-reduced-motion){{text{{animation:none}}}}</style>\n"
        f'<rect width="100%" height="100%" rx="8" fill="{BACKGROUND}"/>\n' + "\n".join(texts) + "\n</svg>\n", encoding="utf8")


main()

#!/usr/bin/env python3
"""Makes an animated SVG of a recorded motion and its prediction from the first film of a report.

    examples/report/banner.py REPORT.html OUTPUT.svg

The SVG has no scripts, and its own colours for light and for dark pages.
"""
import html
import json
import pathlib
import re
import sys

STYLE = """
text{font:34px Helvetica,Arial,sans-serif;fill:#222}
polyline{fill:none;stroke-width:9;stroke-linejoin:round;stroke-linecap:round}
.recorded{stroke:#1f5fa8}.full{stroke:#c2570c}.full polyline{stroke-dasharray:34 16}
.path{stroke-width:4;opacity:.55}.floor{stroke:#888;stroke-width:5}.plate{fill:#fff}
@media (prefers-color-scheme:dark){.plate{fill:#0d1117}text{fill:#e6e6e6}.recorded{stroke:#6ea8ee}.full{stroke:#f29a4f}.floor{stroke:#777}}
"""
PAUSE_FRAMES = 12  # the last posture stays, then it begins again
MARGIN_MM = 90


def main(report, output):
    page = pathlib.Path(report).read_text(encoding="utf-8")
    frames = next(
        value
        for value in (json.loads(html.unescape(text)) for text in re.findall(r"\{&quot;lines&quot;.*?\}|\{\"(?:lines|time)\".*?\}", page))
        if "time" in value and "lines" in value
    )
    paths = re.findall(r'<polyline class="(\w+) path" points="([^"]*)"', page)[: len(frames["lines"])]
    times = frames["time"] + [frames["time"][-1]] * PAUSE_FRAMES
    step_s = (frames["time"][-1] - frames["time"][0]) / (len(frames["time"]) - 1)
    lasts_s = step_s * len(times)
    points = [tuple(map(float, pair.split(","))) for motion in frames["lines"] for lines in motion for line in lines.split(";") for pair in line.split()]
    left, right = min(x for x, _ in points) - MARGIN_MM, max(x for x, _ in points) + MARGIN_MM
    top = min(y for _, y in points) - 2 * MARGIN_MM
    floor = float(re.search(r'class="floor" x1="[^"]*" y1="([^"]*)"', page).group(1))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{left:.0f} {top:.0f} {right - left:.0f} {floor - top + 60:.0f}" role="img">',
        "<title>A recorded jump of a Go1 and its prediction by the model from the first state</title>",
        f"<style>{STYLE.strip()}</style>",
        # A page may be dark where the system is light.
        f'<rect class="plate" x="{left:.0f}" y="{top:.0f}" width="100%" height="100%" rx="16"/>',
        f'<line class="floor" x1="{left:.0f}" x2="{right:.0f}" y1="{floor + 5:.0f}" y2="{floor + 5:.0f}"/>',
    ]
    for role, path in paths:
        parts.append(f'<polyline class="{role} path" points="{path}"/>')
    for (role, _), motion in zip(paths, frames["lines"]):
        last = motion[0]
        shown = []
        for lines in motion + [motion[-1]] * PAUSE_FRAMES:
            last = lines or last  # a prediction that ended stays where it was
            shown.append(last.split(";"))
        group = []
        for line in range(len(shown[0])):
            values = ";".join(frame[line] for frame in shown)
            group.append(
                f'<polyline points="{shown[0][line]}"><animate attributeName="points" dur="{lasts_s:.2f}s" repeatCount="indefinite" values="{values}"/></polyline>'
            )
        parts.append(f'<g class="{role}">{"".join(group)}</g>')
    for place, (role, words) in enumerate([("recorded", "recorded, unseen in training"), ("full", "predicted by 7 equations")]):
        x, y = left + 40, top + 50 + 50 * place
        parts.append(f'<g class="{role}"><polyline points="{x:.0f},{y:.0f} {x + 90:.0f},{y:.0f}"/></g>')
        parts.append(f'<text x="{x + 110:.0f}" y="{y + 12:.0f}">{words}</text>')
    pathlib.Path(output).write_text("\n".join(parts) + "\n</svg>\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])

"""The report page of a session: pictures, force, sound and numbers, with an explanation in plain language."""
import base64
import html
import json
from pathlib import Path

STYLE = """
:root { color-scheme: light; --ink: #24272b; --soft: #6a6f76; --line: #e3e0da; --paper: #faf8f4; --accent: #c8553d; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.55 system-ui, "DejaVu Sans", sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 40px 24px 80px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 6px; }
h2 { font-size: 20px; margin: 48px 0 10px; }
p { max-width: 74ch; margin: 8px 0; }
.lead { color: var(--soft); }
.badge { display: inline-block; border: 1px solid var(--accent); color: var(--accent); border-radius: 99px;
  padding: 1px 12px; font-size: 13px; margin: 10px 8px 0 0; }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(200px, 1fr)); gap: 12px; margin: 26px 0 0; }
.fact { background: white; border: 1px solid var(--line); border-radius: 10px; padding: 12px 16px; }
.fact b { display: block; font-size: 23px; line-height: 1.3; }
.fact span { color: var(--soft); font-size: 13px; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(380px, 1fr)); gap: 14px; margin-top: 12px; }
figure { margin: 0; background: white; border: 1px solid var(--line); border-radius: 10px; overflow: hidden; }
figure img { display: block; width: 100%; }
figcaption { padding: 8px 14px; color: var(--soft); font-size: 14px; }
figure.wide { margin-top: 12px; padding: 10px 10px 0; }
audio { width: 100%; margin: 12px 0 0; }
table { border-collapse: collapse; width: 100%; background: white; border: 1px solid var(--line); margin-top: 10px; }
th, td { text-align: left; padding: 6px 12px; border-bottom: 1px solid var(--line); font-size: 14px;
  vertical-align: top; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.scroll { overflow-x: auto; } details { margin-top: 14px; }
pre { overflow: auto; font-size: 12.5px; background: white; border: 1px solid var(--line);
  padding: 12px; border-radius: 8px; }
"""


def text(value):
    return html.escape(str(value))


def picture(folder: Path, name, caption, wide=False):
    file = folder / name
    if not file.exists():
        return ""
    data = base64.b64encode(file.read_bytes()).decode("ascii")
    return (f'<figure{" class=wide" if wide else ""}><img alt="{text(caption)}" src="data:image/png;base64,{data}">'
            f"<figcaption>{text(caption)}</figcaption></figure>")


def fact(value, what):
    return f"<div class=fact><b>{text(value)}</b><span>{text(what)}</span></div>"


def ms(value):
    return "–" if value is None else f"{value:.1f} ms"


def cutting_steps(numbers):
    """The plan's steps that cut bone, as the haptic client reports them."""
    return [step for step in numbers["programs"]["haptic"]["steps"] if "while_cutting" in step]


def step_rows(numbers):
    rows = []
    scale = numbers["programs"]["haptic"]["force_scale"]
    for step in cutting_steps(numbers):
        mean = step["while_cutting"]
        plunge = f"{step['plunge_mm']:.1f}" if step.get("broke_through") else "–"
        cells = (f"{step['thickness_mm']:.1f}", f"{step['deepest_mm']:.1f}", f"{mean['seconds']:.1f}",
                 f"{mean['feed_mm_per_s']:.1f}", f"{mean['density_g_cm3']:.2f}", f"{mean['force_n']:.1f}",
                 f"{step['peak_force_n']:.1f}", f"{scale * step['peak_force_n']:.2f}", plunge,
                 f"{step['removed_mm3']:.0f}")
        rows.append(f"<tr><td>{text(step['tool'])}</td>" +
                    "".join(f"<td class=n>{cell}</td>" for cell in cells) + "</tr>")
    return "".join(rows)


LATENCIES = {
    "cut_to_commit": ("cut to confirmation",
                      "from the end of a cut in the haptic client until the server acknowledges the applied cut"),
    "cut_to_mesh": ("cut to mesh", "from the end of a cut until the viewer has received the new surface"),
    "cut_to_picture": ("cut to picture", "from the end of a cut until the viewer has drawn it"),
    "cut_to_sound": ("cut to sound",
                     "from a cutting state of the haptic loop until the audio client has put it into its sound"),
}


def latency_rows(numbers):
    rows = []
    for key, (name, meaning) in LATENCIES.items():
        value = numbers["latency_ms"].get(key)
        if value:
            rows.append(f"<tr><td><b>{name}</b><br>{meaning}</td><td class=n>{ms(value['p50'])}</td>"
                        f"<td class=n>{ms(value['p99'])}</td><td class=n>{value['count']}</td></tr>")
    return "".join(rows)


def flattened(tree, prefix=""):
    """Leaves of nested objects as (dotted name, value)."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from flattened(value, f"{prefix}{key}.")
    elif isinstance(tree, list) and len(tree) > 4:
        yield prefix.rstrip("."), f"{len(tree)} entries"
    else:
        yield prefix.rstrip("."), tree


def program_tables(numbers):
    parts = []
    for name, summary in numbers["programs"].items():
        rows = "".join(f"<tr><td>{text(key)}</td><td class=n>{text(value)}</td></tr>"
                       for key, value in flattened(summary))
        parts.append(f"<details><summary>osteon-{name}</summary><table>{rows}</table></details>")
    return "".join(parts)


def write(folder: Path, numbers, title):
    """Writes report.html into the session's folder. Pictures are inside the page, the sound is a file beside it."""
    latency, agreement = numbers["latency_ms"], numbers["agreement"]
    removed = numbers["programs"]["server"].get("removed_mm3")
    same = "identical" if agreement["field_hash_equal"] and not agreement["mesh_differences"] else "NOT identical"
    journal = numbers["journal"]
    replayed = journal["sound"] and journal["field_hash"] == agreement["field_hash_server"]
    kept = "the same bone" if replayed else "NOT the same bone"
    facts = [
        fact(f"{removed:.0f} mm³" if isinstance(removed, (int, float)) else "–", "bone removed"),
        fact(f"{max((step['peak_force_n'] for step in cutting_steps(numbers)), default=0):.1f} N",
             "largest force of the bone on a tool"),
        fact(ms(latency.get("cut_to_picture", {}).get("p50")), "from a cut to its picture (median)"),
        fact(ms(latency.get("cut_to_sound", {}).get("p50")), "from the cutting to its sound (median)"),
        fact(same, "bone in server, haptic client and viewer at the end (hashes)"),
        fact(kept, f"made again from the room's journal, {journal['events']} events"),
    ]
    machine = numbers["machine"]
    virtual = numbers["picture"].startswith("a virtual screen")
    drawn_by = "; drawing it without a graphics card takes most of the time from cut to picture" if virtual else ""
    page = f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{text(title)} – Osteon session</title><style>{STYLE}</style></head><body><main>
<h1>{text(title)}</h1>
<p class=lead>One session of Osteon, a distributed simulator of bone surgery: four programs on one machine shared one
bone, and a simulated surgeon worked on it for {numbers['seconds_of_work']:.0f} seconds.<br>
{text(numbers['case'].get('source', ''))}; sampled at {numbers['case'].get('pitch_mm', 0):.2f} mm.</p>
<span class=badge>simulated device: no person and no haptic hardware took part</span>
<div class=facts>{''.join(facts)}</div>

<h2>Before and after</h2>
<p>The server keeps the bone together with everything that was cut away; the viewer receives only the blocks of surface
that changed. Cut faces have a colour of their own.</p>
<div class=pair>{picture(folder, 'before.png', 'Before')}{picture(folder, 'after.png', 'After')}</div>

<h2>The cuts from near</h2>
<div class=pair>{picture(folder, 'hole.png', 'The drilled hole')}
{picture(folder, 'window.png', 'The window made with a round burr')}</div>
{picture(folder, 'during.png', 'At work: the tool where the bone lets it be, as the viewer showed it', wide=True)}

<h2>Force, feed and depth</h2>
<p>Pushing harder drills faster, and dense bone needs more force than spongy bone. The hand pushes with nearly constant
force. So the <b>feed</b> shows where the drill is: slow in dense cortex, as the outer table of a skull or the wall of a
shaft; faster in the spongy bone or the marrow below it; slow again in the cortex of the far side. When the far cortex
breaks, nothing holds the tool back. It plunges until the hand has reacted. <b>Physical</b> force is the force of the
bone on the tool. <b>Rendered</b> force is the force of a device on the hand: physical force, scaled by
{numbers['programs']['haptic']['force_scale']:g} to the range of the device. Shaded: between a tool's first and last
cut.</p>
{picture(folder, 'force_depth.png', 'Force, feed and depth over time; force over depth for each tool', wide=True)}
<div class=scroll><table><tr><th>tool</th><th class=n>bone here, mm</th>
<th class=n>deepest, mm</th><th class=n>cutting, s</th>
<th class=n>feed, mm/s</th><th class=n>density, g/cm³</th><th class=n>mean force, N</th><th class=n>peak, N</th>
<th class=n>peak rendered, N</th><th class=n>plunge, mm</th><th class=n>removed, mm³</th></tr>
{step_rows(numbers)}</table></div>

<h2>Sound</h2>
<p>The sound is made from the same cutting states. Its pitch follows the spindle and drops under load. Its level and
colour follow the amount and the density of the bone being cut.</p>
<audio controls preload="none" src="sound.wav"></audio>
{picture(folder, 'spectrogram.png', 'Level and spectrogram of the sound', wide=True)}

<h2>Latency of a cut</h2>
<table><tr><th>latency</th><th class=n>median</th><th class=n>99 %</th><th class=n>events</th></tr>
{latency_rows(numbers)}</table>
<p class=lead>Measured on {text(machine['processor'])}, {machine['cores']} cores, with all programs on it.
Picture: {text(numbers['picture'])}{drawn_by}.</p>

<h2>Everything else</h2>
<p>Field hash of the server: <code>{text((agreement['field_hash_server'] or '–')[:16])}…</code>, of the haptic client:
<code>{text((agreement['field_hash_haptic'] or '–')[:16])}…</code>. The complete numbers are in
<a href="session.json">session.json</a>. The 1 kHz record is <a href="session.h5">session.h5</a>
(HDF5, which <code>--device recorded:session.h5</code> plays again). A shorter table is
<a href="session.csv">session.csv</a>. The room itself is in <code>session.journal</code>:
<code>osteon-server --case CASE --journal session.journal</code> continues it.</p>
{program_tables(numbers)}
<details><summary>The surgeon's plan</summary>
<pre>{text(json.dumps(numbers['plan'], indent=2))}</pre></details>
</main></body></html>
"""
    (folder / "report.html").write_text(page, encoding="utf-8")

"""Writes loop files."""
import json

from kinds import INDEX, KINDS


def number(value):
    if isinstance(value, (str, list)):
        return json.dumps(value)
    return repr(float(value))


def write(path, sample_time, units, law, plant, sensor_noise=None, terms=()):
    parts = [("loop", dict(sample_time_s=sample_time)), ("units", units), ("controller", law), ("plant", plant)]
    if sensor_noise is not None:
        parts.append(("sensor", dict(noise=sensor_noise)))
    lines = []
    for name, table in parts:
        lines += [f"[{name}]", *(f"{key} = {number(value)}" for key, value in table.items()), ""]
    for term in sorted(terms, key=lambda term: INDEX[term["kind"]]):
        lines += ["[[physics]]", f'kind = "{term["kind"]}"']
        lines += [f"{name} = {number(term['params'][name])}" for name in KINDS[term["kind"]][1]]
        if "spans" in term:
            lines.append(f"spans = {json.dumps(term['spans'])}")
        if term["onset_s"] > 0:
            lines.append(f"onset_s = {number(term['onset_s'])}")
        lines.append("")
    with open(path, "w") as file:
        file.write("\n".join(lines))

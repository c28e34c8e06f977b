#!/usr/bin/env python3
"""Where the time of our hemicube rows goes, function by function, inlined ones told apart.

    ./profile.py [scene's words]        needs Linux's perf, binutils, and a built rival (cargo run --release)

Samples of the processor's clock, two thousand a second; each counts for the innermost function of the engine that
the compiler inlined there. Arithmetic on registers (radiosity::simd) counts for its caller.
"""

import collections
import pathlib
import re
import subprocess
import sys
import tempfile

here = pathlib.Path(__file__).parent
binary = here / "target/release/radiosity-rival"
ENGINE = "/radiosity/src/"


def bare(name):
    """The last part of a function's path, without what it is generic over."""
    while (shorter := re.sub(r"<[^<>]*>", "", name)) != name:
        name = shorter
    parts = [part for part in name.split("::") if part and not part.startswith("{")]
    return parts[-1] if parts else name


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


with tempfile.TemporaryDirectory() as folder:
    data = f"{folder}/perf.data"
    print(run("perf", "record", "-q", "-e", "cpu-clock", "-F", "2000", "-o", data, binary, "profile", *sys.argv[1:]))
    events = run("perf", "script", "-i", data, "--show-mmap-events", "-F", "ip,sym,event,comm,dso")

# Where the program was loaded, and where its segments say they want to be.
maps = re.findall(r"\[0x(\w+)\(0x\w+\) @ (?:0x)?(\w+) .*r-xp (\S+)", events)
base, file_offset = next((int(a, 16), int(o, 16)) for a, o, path in maps if path.endswith(binary.name))
segments = re.findall(r"LOAD\s+0x(\w+) 0x(\w+) 0x\w+ 0x(\w+) 0x\w+ R E", run("readelf", "-lW", binary))
starts = [(int(offset, 16), int(wanted, 16)) for offset, wanted, _ in segments]
shift = next(wanted - offset for offset, wanted in starts if offset // 4096 * 4096 == file_offset)

counts = collections.Counter()
elsewhere = collections.Counter()
for ip, symbol, dso in re.findall(r"\b([0-9a-f]{6,16}) (.*) \((\S+)\)$", events, re.M):
    if dso.endswith(binary.name):
        counts[int(ip, 16) - base + file_offset + shift] += 1
    else:
        elsewhere[f"{pathlib.Path(dso).name}: {symbol}"] += 1

addresses = sorted(counts)
with tempfile.NamedTemporaryFile("w") as listed:
    listed.write("".join(f"{address:#x}\n" for address in addresses))
    listed.flush()
    lines = run("addr2line", "-aifC", "-e", binary, f"@{listed.name}").splitlines()

shares = collections.Counter()
frames = collections.defaultdict(list)
for line in lines:
    if line.startswith("0x"):
        address = int(line, 16)
    else:
        frames[address].append(line)
for address, chain in frames.items():
    calls = [(bare(name), pathlib.Path(place.rsplit(":", 1)[0])) for name, place in zip(chain[::2], chain[1::2])]
    ours = [f"{path.name}: {name}" for name, path in calls if ENGINE in str(path) and path.name != "simd.rs"]
    shares[ours[0] if ours else calls[-1][0]] += counts[address]
shares.update(elsewhere)
total = sum(shares.values())
print("| function | share |\n|---|---|")
for name, count in shares.most_common(16):
    print(f"| `{name}` | {100 * count / total:.1f} % |")

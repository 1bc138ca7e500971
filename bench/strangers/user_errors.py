"""Writes campaigns of vehicles from `draw.py`, `one_axis.py` and `boats.py` with errors that users make.

Each error changes the files as a user would get them wrong: a sign, two columns exchanged, a unit that
is not the log's, a sensor that is mounted at an angle. The logs themselves are right.

    user_errors.py write OUT DRAWS SEED [ERROR ...]   # OUT/KIND-ERROR-SEED/campaign.toml and error.json
    user_errors.py judge PROGRAM OUT [PATTERN]        # identifies each, and counts what is named

`healthy`, `healthy_six` and `healthy_boat` are errors, too: vehicles as they were drawn, with their faults. Named rightly:
a caveat or an error message names the channel and the correction. Unnoticed: nothing is named, no
plant is doubtful, and a mass is off by more than 20 %.
"""

import json
import re
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random

import boats
import one_axis
from running import identify

AXES = ["surge", "sway", "heave", "roll", "pitch", "yaw"]
KGF, LBF, KNOT, KM_H, FOOT = 9.80665, 4.4482216, 1.943844, 3.6, 3.28084

# Error: a function of a campaign's texts and a generator, and the words that a message must
# contain.
ONE_AXIS, TOGETHER = {}, {}


def error(table, *said, wrench=False, axes=None):
    def keep(f):
        entry = {"change": f, "said": said, "wrench": wrench, "axes": axes}
        table[f.__name__] = entry
        return f

    return keep


class Files:
    """The texts of a vehicle file and a campaign file."""

    def __init__(self, folder):
        self.folder = folder
        self.vehicle = (folder / "vehicle.toml").read_text()
        self.campaign = (folder / "campaign.toml").read_text()

    def write(self):
        (self.folder / "vehicle.toml").write_text(self.vehicle)
        (self.folder / "campaign.toml").write_text(self.campaign)

    def channel(self, quantity, extra):
        """Adds keys to channels, such as `negate = true`; the quantity is a pattern."""
        pattern = rf'("(?:{quantity})" = \{{[^}}]*?) \}}'
        self.campaign, found = re.subn(pattern, rf"\1, {extra} }}", self.campaign)
        assert found, quantity

    def exchange(self, a, b):
        """Exchanges the columns of two channels."""
        column = {
            name: re.search(rf'"{re.escape(name)}" = (\{{[^}}]*\}})', self.campaign)[1]
            for name in (a, b)
        }
        for name, other in ((a, b), (b, a)):
            pattern = rf'"{re.escape(name)}" = \{{[^}}]*\}}'
            self.campaign = re.sub(pattern, f'"{name}" = {column[other]}', self.campaign)

    def curves(self, factor):
        """Multiplies the thrust curves."""
        times = lambda m: f"{m[1]} = {float(m[2]) * factor:.9g}"
        self.vehicle, found = re.subn(r"(forward|reverse) = ([0-9.e+-]+)", times, self.vehicle)
        assert found

    def thruster(self, name, change):
        """Changes the entry of a thruster."""
        parts = re.split(r"(?=\[\[thruster\]\]|\[rigid_body\])", self.vehicle)
        at = next(k for k, part in enumerate(parts) if f'name = "{name}"\n' in part)
        parts[at] = change(parts[at])
        self.vehicle = "".join(parts)


def turned(entry):
    """A thruster's entry with the other direction."""
    numbers = lambda m: "direction = " + str([-float(x) for x in json.loads(m[1])])
    return re.sub(r"direction = (\[.*\])", numbers, entry)


def in_mm(entry):
    numbers = lambda m: "position_m = " + str([1000 * float(x) for x in json.loads(m[1])])
    return re.sub(r"position_m = (\[.*\])", numbers, entry)


@error(ONE_AXIS)
def healthy(f, g, axis):
    pass


MOTION = r"velocity\.(?:surge|sway|heave)|attitude\.heading"


@error(ONE_AXIS, "velocity of", "reversed")
def motion_sign(f, g, axis):
    f.channel(MOTION, "negate = true")


@error(ONE_AXIS, "thrusters that act in", "reversed")
def thrust_sign(f, g, axis):
    f.thruster("A", turned)
    f.thruster("B", turned)


@error(ONE_AXIS, "`A`", "reversed", axes=["surge", "sway", "heave"])
def one_thruster_sign(f, g, axis):
    f.thruster("A", turned)


@error(ONE_AXIS, "exchanged", axes=["yaw"])
def thrusters_exchanged(f, g, axis):
    f.exchange("thruster.A.speed", "thruster.B.speed")


@error(ONE_AXIS, "depth", "reversed", axes=["heave"])
def depth_up(f, g, axis):
    f.channel("depth", "negate = true")


@error(ONE_AXIS, "depth", " mm", axes=["heave"])
def depth_mm(f, g, axis):
    f.channel("depth", "scale = 1000")


@error(ONE_AXIS, "kgf", axes=["surge", "sway", "heave"])
def thrust_kgf(f, g, axis):
    f.curves(1 / KGF)


@error(ONE_AXIS, "lbf", axes=["surge", "sway", "heave"])
def thrust_lbf(f, g, axis):
    f.curves(1 / LBF)


@error(ONE_AXIS, "rpm", axes=["surge", "sway", "heave"])
def curve_of_rpm(f, g, axis):
    f.curves((30 / 3.14159265) ** -2)


@error(ONE_AXIS, " kn", axes=["surge", "sway", "heave"])
def speed_knots(f, g, axis):
    f.channel(MOTION, f"scale = {KNOT}")


@error(ONE_AXIS, "km/h", axes=["surge", "sway", "heave"])
def speed_km_h(f, g, axis):
    f.channel(MOTION, f"scale = {KM_H}")


@error(ONE_AXIS, "mm/s", axes=["surge", "sway", "heave"])
def speed_mm(f, g, axis):
    f.channel(MOTION, "scale = 0.001")


@error(ONE_AXIS, "cm/s", axes=["surge", "sway", "heave"])
def speed_cm(f, g, axis):
    f.channel(MOTION, "scale = 100")


@error(ONE_AXIS, "position_m", " mm", axes=["yaw"])
def places_mm(f, g, axis):
    f.thruster("A", in_mm)
    f.thruster("B", in_mm)


@error(ONE_AXIS, "deg", axes=["yaw"])
def heading_deg(f, g, axis):
    f.channel(MOTION, "scale = 57.29578")


@error(TOGETHER)
def healthy_six(f, g, axis):
    pass


for kind, channel in {
    "surge_sign": r"dvl\.velocity\.x",
    "sway_sign": r"dvl\.velocity\.y",
    "heave_sign": r"dvl\.velocity\.z",
    "yaw_rate_sign": r"rate\.yaw",
}.items():

    def sign(f, g, axis, channel=channel):
        f.channel(channel, "negate = true")

    sign.__name__ = kind
    error(TOGETHER, channel.replace("\\", ""), "reversed")(sign)


@error(TOGETHER, "yaw", "reversed")
def yaw_sign(f, g, axis):
    f.channel(r"rate\.yaw|attitude\.heading", "negate = true")


@error(TOGETHER, "`T2`", "reversed")
def horizontal_thruster_sign(f, g, axis):
    f.thruster("T2", turned)


@error(TOGETHER, "`T6`", "reversed")
def vertical_thruster_sign(f, g, axis):
    f.thruster("T6", turned)


for kind, (a, b) in {
    "front_exchanged": ("T1", "T2"),
    "vertical_exchanged": ("T5", "T8"),
    "across_exchanged": ("T3", "T7"),
}.items():

    def exchanged(f, g, axis, a=a, b=b):
        f.exchange(f"thruster.{a}.speed", f"thruster.{b}.speed")

    exchanged.__name__ = kind
    error(TOGETHER, f"`{a}`", f"`{b}`", "exchanged")(exchanged)


@error(TOGETHER, "surge and sway", "exchanged")
def dvl_exchanged(f, g, axis):
    f.exchange("dvl.velocity.x", "dvl.velocity.y")


@error(TOGETHER, "sway and heave", "reversed")
def dvl_flu(f, g, axis):
    f.channel(r"dvl\.velocity\.[yz]", "negate = true")


@error(TOGETHER, "sway, heave, pitch and yaw", "reversed")
def all_flu(f, g, axis):
    names = r"dvl\.velocity\.[yz]|rate\.(?:pitch|yaw)|attitude\.(?:pitch|heading)"
    f.channel(names, "negate = true")


for degrees in (45, 90, 180):

    def mounted(f, g, axis, degrees=degrees):
        # The DVL's own axes are turned from the vehicle's, and the file does not say so.
        f.vehicle += f"[sensor.dvl]\nrotation_deg = [0, 0, {-degrees}]\n"

    mounted.__name__ = f"dvl_turned_{degrees}"
    # The correct angle is that of the file less this: zero.
    error(TOGETHER, f"turned by {degrees}", "rotation_deg = [0, 0, 0]")(mounted)


@error(TOGETHER, "wrench of sway", "reversed", wrench=True)
def wrench_sign(f, g, axis):
    f.channel(r"wrench\.sway", "negate = true")


@error(TOGETHER, "surge and sway", "exchanged", wrench=True)
def wrench_exchanged(f, g, axis):
    f.exchange("wrench.surge", "wrench.sway")


@error(TOGETHER, "wrench.surge", "kgf", wrench=True)
def wrench_kgf(f, g, axis):
    f.channel(r"wrench\.surge", f"scale = {1 / KGF}")


@error(TOGETHER, "kgf")
def curves_kgf(f, g, axis):
    f.curves(1 / KGF)


@error(TOGETHER, "lbf")
def curves_lbf(f, g, axis):
    f.curves(1 / LBF)


@error(TOGETHER, " kn")
def dvl_knots(f, g, axis):
    f.channel(r"dvl\.velocity\.[xyz]", f"scale = {KNOT}")


@error(TOGETHER, "km/h")
def dvl_km_h(f, g, axis):
    f.channel(r"dvl\.velocity\.[xyz]", f"scale = {KM_H}")


@error(TOGETHER, "position_m", " mm")
def thrusters_mm(f, g, axis):
    f.vehicle = in_mm(f.vehicle)


@error(TOGETHER, "rate", "deg")
def rates_deg(f, g, axis):
    f.channel(r"rate\.(?:roll|pitch|yaw)", "scale = 57.29578")


@error(TOGETHER, "attitude", "deg")
def tilt_deg(f, g, axis):
    f.channel(r"attitude\.(?:roll|pitch)", "scale = 57.29578")


@error(TOGETHER, 'symmetry = "none"')
def symmetry(f, g, axis):
    f.campaign = f.campaign.replace('symmetry = "none"\n', "")


def of_channel(quantity, extra):
    return lambda f: f.channel(quantity, extra)


def of_exchange(a, b):
    return lambda f: f.exchange(a, b)


def of_heading(extra):
    return of_channel(r"attitude\.heading", extra)


def of_thrusters(*names):
    return lambda f: [f.thruster(name, turned) for name in names]


FIXES = [f"position.{way}" for way in ("latitude", "longitude")]
OVER_GROUND = [f"velocity.{way}" for way in ("north", "east")]

# Errors with boats: what the boat has, the change of its files, and the words that a message must contain.
OF_BOATS = {
    "healthy_boat": ([], lambda f: None),
    "propellers_exchanged": (
        ["propellers"],
        of_exchange("thruster.port.speed", "thruster.starboard.speed"),
        "`port`",
        "`starboard`",
        "exchanged",
    ),
    "propeller_sign": (["propellers"], of_thrusters("port"), "`port`", "reversed"),
    "propellers_sign": (["propellers"], of_thrusters("port", "starboard"), "reversed"),
    "rudder_sign": (
        ["rudder"],
        of_channel(r"rudder\.rudder\.angle", "negate = true"),
        "rudder",
        "reversed",
    ),
    "boat_heading_deg": ([], of_heading("scale = 57.29578"), "attitude.heading", "deg"),
    "boat_heading_rad": ([], of_heading("scale = 0.01745329"), "attitude.heading", "rad"),
    "boat_heading_sign": ([], of_heading("negate = true"), "attitude.heading", "reversed"),
    "boat_heading_from_east": (
        [],
        of_heading("negate = true, offset = -90"),
        "attitude.heading",
        "east",
    ),
    "boat_heading_plus_90": ([], of_heading("offset = 90"), "turned by 90"),
    "boat_heading_plus_180": ([], of_heading("offset = 180"), "turned by 180"),
    "boat_rate_deg": (
        ["gyroscope"],
        of_channel(r"rate\.yaw", "scale = 57.29578"),
        "rate.yaw",
        "deg",
    ),
    "boat_rate_sign": (
        ["gyroscope"],
        of_channel(r"rate\.yaw", "negate = true"),
        "rate.yaw",
        "reversed",
    ),
    "fixes_exchanged": (["rtk"], of_exchange(*FIXES), *FIXES, "exchanged"),
    "ground_exchanged": (["doppler"], of_exchange(*OVER_GROUND), *OVER_GROUND, "exchanged"),
    "longitude_west": (
        ["rtk"],
        of_channel(r"position\.longitude", "negate = true"),
        "position.longitude",
        "reversed",
    ),
    "ground_knots": (["course"], of_channel(r"ground\.speed", f"scale = {KNOT}"), " kn"),
    "boat_kgf": ([], lambda f: f.curves(1 / KGF), "kgf"),
}
BOATS = {
    name: {"change": lambda f, g, axis, change=change: change(f), "said": said, "boat": boat}
    for name, (boat, change, *said) in OF_BOATS.items()
}


def one_of_one(out, name, seed):
    """Writes a vehicle of one axis with an error: without other faults in three of four, else
    with one."""
    entry, g = ONE_AXIS[name], Random(1000 * seed + len(name))
    axes = entry["axes"] or one_axis.AXES
    faults = ["plain"] if g.random() < 0.75 else ["lag"]
    if name == "healthy":
        faults = []
    for tried in range(seed * 1000, seed * 1000 + 999):
        drawn = one_axis.draw(tried, faults)[0]
        if drawn["axis"] in axes:
            break
    folder = out / f"single-{name}-{seed:03}"
    s = one_axis.write(folder, tried, faults)
    f = Files(folder)
    # Added mass of hulls is from a twentieth to one and a half times their own; thrusters that turn a
    # hull sit about a third of its length from the middle, and hulls of 1 m weigh 300 kg.
    turns = s["axis"] == "yaw"
    dry = 300.0 * (s["arm"] / 0.35) ** 3 if turns else s["mass"] / g.uniform(1.05, 2.5)
    f.vehicle = f"dry_mass_kg = {dry:.5g}\n" + f.vehicle
    entry["change"](f, g, s["axis"])
    f.write()
    truth = {"kind": "single", "error": name, "said": entry["said"], "axis": s["axis"]}
    truth |= {"faults": s["faults"], "mass": {s["axis"]: s["mass"]}}
    (folder / "error.json").write_text(json.dumps(truth))
    return folder.name


# Faults of boats beside an error.
BOATS_FAULTS = (
    "lag",
    "reverse",
    "wind",
    "gusts",
    "waves",
    "current",
    "noise",
    "late_fixes",
    "advance",
)

# Number of drawn vehicles of six axes; an error uses one of them, because a draw takes half a
# minute.
POOL = {"thrusters": 10, "wrench": 4}


def vehicle_of_six(out, kind, k):
    """Returns the folder of a vehicle of the pool, with one or two faults; draws it if it is
    absent."""
    folder = out / f"vehicle-{kind}-{k}"
    if not (folder / "truth.json").exists():
        import draw

        g = Random(f"{kind} {k}")
        left_out = ("thrust_scale", "wrench_log", "strips")
        kept = [fault for fault in draw.FAULTS if fault not in left_out]
        faults = g.sample(kept, g.choice([1, 2]))
        draw.one((folder, 5000 + k, faults + ["wrench_log"] * (kind == "wrench")))
    return folder


def one_of_six(out, name, seed):
    """Writes a vehicle of six axes with an error."""
    entry = TOGETHER[name]
    kind = (
        "wrench"
        if entry["wrench"] or (name.startswith("healthy") and seed >= 10)
        else "thrusters"
    )
    at = seed if name.startswith("healthy") else 3 * list(TOGETHER).index(name) + seed
    drawn_in = vehicle_of_six(out, kind, at % POOL[kind])
    folder = out / f"six-{name}-{seed:03}"
    folder.mkdir(parents=True, exist_ok=True)
    for text in ("vehicle.toml", "campaign.toml"):
        shutil.copy(drawn_in / text, folder / text)
    f = Files(folder)
    f.campaign = re.sub(r'"(\S+?/\w+\.csv)"', rf'"../{drawn_in.name}/\1"', f.campaign)
    entry["change"](f, None, None)
    f.write()
    drawn = json.loads((drawn_in / "truth.json").read_text())
    truth = {"kind": "six", "error": name, "said": entry["said"], "faults": drawn["faults"]}
    truth["mass"] = {axis: drawn["M"][k][k] for k, axis in enumerate(AXES)}
    (folder / "error.json").write_text(json.dumps(truth))
    return folder.name


def one_of_boats(out, name, seed):
    """Writes a boat with an error, without other faults in half of them, else with one; states its mass."""
    entry, g = BOATS[name], Random(f"{name} {seed}")
    has_gyro = ["gyroscope"] if g.random() < 0.6 else ["no_gyroscope"]
    faults = ["healthy"] if g.random() < 0.5 else [g.choice(BOATS_FAULTS)]
    folder = out / f"boat-{name}-{seed:03}"
    if not (folder / "truth.json").exists():
        boats.drawn((folder, g.randrange(10**6), [*has_gyro, *entry["boat"], *faults]))
    drawn = json.loads((folder / "truth.json").read_text())
    f = Files(folder)
    if "dry_mass_kg" not in f.vehicle:
        f.vehicle = f"dry_mass_kg = {drawn['mass']:.5g}\n" + f.vehicle
        entry["change"](f, g, None)
        f.write()
    truth = {"kind": "boat", "error": name, "said": entry["said"], "faults": drawn["faults"]}
    truth["mass"] = {axis: drawn["M"][k][k] for k, axis in enumerate(boats.AXES)}
    (folder / "error.json").write_text(json.dumps(truth))
    return folder.name


def write(out, draws, seed, wanted):
    jobs = []
    tables = ((ONE_AXIS, one_of_one), (TOGETHER, one_of_six), (BOATS, one_of_boats))
    for table, make in tables:
        for name in table:
            if wanted and name not in wanted:
                continue
            jobs += [(make, name, k) for k in range(seed, seed + draws)]
    for make, name, k in jobs:
        print(make(out, name, k), flush=True)


def judge_one(program, folder):
    truth = json.loads((folder / "error.json").read_text())
    results, error = identify(program, folder)
    row = {"name": folder.name, "error": truth["error"], "kind": truth["kind"]}
    row |= {"faults": truth["faults"], "trust": "refused", "named": [], "off": None}
    if results is None:
        row["named"] = sorted(set(re.findall(r"[^.\n]*(?: looks? )[^\n]*", error)))
        row["reason"] = error[-300:]
    else:
        plants = results["plants"].values()
        caveats = [c for plant in plants for c in plant["caveats"]] + results["caveats"]
        row["named"] = sorted({c["message"] for c in caveats if c["code"] == "likely-mistake"})
        row["named"] += [x["message"] for x in results["failures"] if " look" in x["message"]]
        row["doubts"] = sorted({c["message"] for c in caveats if c["code"] in INSTRUMENTS})
        trusts = [plant["verdict"]["trust"] for plant in plants]
        row["trust"] = max(trusts, key=TRUST.index, default="refused")
        row["codes"] = sorted({c["code"] for c in caveats if c["severity"] != "note"})
        off = []
        for plant in plants:
            for axis, mass in truth["mass"].items():
                found = plant["parameters"].get(f"mass.{axis}")
                if found and (len(plant["axes"]) == 1 or axis in AXES[:3]):
                    off.append(found["value"] / mass - 1)
        row["off"] = max(off, key=abs, default=None)
    is_right = lambda message: all(word in message for word in truth["said"])
    row["right"] = any(map(is_right, [*row["named"], *row.get("doubts", [])]))
    return row


# Caveats about instruments also identify faults of a channel.
INSTRUMENTS = ["suspicious-unit", "instruments-disagree"]

TRUST = ["usable", "usable-with-care", "doubtful", "do-not-use", "refused"]


def outcome(row):
    if row["error"].startswith("healthy"):
        return "falsely named" if row["named"] else "healthy, none named"
    if row["right"]:
        return "named rightly"
    if row["named"]:
        return "named wrongly"
    if TRUST.index(row["trust"]) >= TRUST.index("doubtful"):
        return "doubted or refused"
    return "unnoticed" if row["off"] is None or abs(row["off"]) > 0.2 else "harmless"


def judge(program, out, pattern):
    folders = sorted(path.parent for path in out.glob(f"{pattern}/error.json"))
    count = {}
    rows = []
    with ThreadPoolExecutor(1) as pool:
        for row in pool.map(lambda folder: judge_one(program, folder), folders):
            row["outcome"] = outcome(row)
            rows.append(row)
            off = "" if row["off"] is None else f" mass {100 * row['off']:+.0f} %"
            print(f"{row['name']:38} {row['outcome']:20} {row['trust']:17}{off}")
            for message in row["named"]:
                print(f"      {message[:260]}", flush=True)
            key = row["kind"], row["outcome"]
            count[key] = count.get(key, 0) + 1
    for (kind, what), number in sorted(count.items()):
        print(f"{kind:7} {what:20} {number}")
    (out / "judged.json").write_text(json.dumps(rows, indent=1))


def main():
    match sys.argv[1:]:
        case ["write", out, draws, seed, *wanted]:
            write(Path(out), int(draws), int(seed), wanted)
        case ["judge", program, out, *pattern]:
            judge(program, Path(out), pattern[0] if pattern else "*")
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main()

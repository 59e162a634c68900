"""Where the figures of each table of docs/results are in what the table's commands write, for deploy/results.

A reader has the page and the beginning of a table's heading. It asks the task for runs of the commands that the page
tells, with a row's flags and the capitals of the page filled in, and puts figures into cells. No command stands here.
The file is as long as there are tables: a table is a reader, found by its page and heading.
"""

import functools
import os
import re
import statistics

NotMade = RuntimeError  # deploy/results puts its own here
GIVEN = object()  # in place of a cell's figure that the run does not give, such as how many runs were asked for
READERS = {}
WORLDS = ("mujoco", "ode")


def reads(page, heading):
    def keep(function):
        READERS[page, heading] = function
        return function
    return keep


def reads_row(page, heading):
    """As `reads`, for a function that also takes a row's number, its first cell and all its cells: it is called for each row."""
    def keep(function):
        READERS[page, heading] = lambda task: task.each(functools.partial(function, task))
        return function
    return keep


def each_column(task, columns, make):
    """make(place, what) of the columns after the first, `what` from `columns`; what cannot be made is told of its column."""
    for place, what in enumerate(columns, 1):
        try:
            make(place, what)
        except NotMade as problem:
            for i in task.rows():
                task.lack(i, str(problem), place)


def put_each(task, i, first, runs, *metrics):
    """A metric a column, from `first` on: the figures that the runs have of it."""
    for place, metric in enumerate(metrics, first):
        task.put(i, place, *(run[metric] for run in runs))


def reader(claim):
    page = os.path.basename(claim.page)[:-3]
    found = [value for (p, heading), value in READERS.items() if p == page and claim.heading.startswith(heading)]
    if not found:
        raise NotMade(claim.by_hand or "no reader takes this table's figures")
    return found[0]


def flags(cells):
    """The flags that a row's cells name."""
    return " ".join(span for cell in cells for span in re.findall(r"`(--[^`]+)`", cell))


def robot(text):
    """A robot as the pages call it, as `poise list robots` does."""
    name = re.match(r"[\w ']+", text)[0].split("'")[0].split()[0].lower()
    return "dyros/dyros_legs" if name in ("the", "paper") else f"{name}/{name}"


def quantile(values, share):
    values = sorted(values)
    return values[min(int(share * len(values)), len(values) - 1)]


def column(rows, name):
    return [row[name] for row in rows if row[name] != ""]


def stands(rows):
    return [row for row in rows if row["outcome"] == "stands"]


# The paper's experiments: section and a word of the row to metrics, in the order of the row's figures.
SECTIONS = {"7.1": "gravity_compensation", "7.2": "push_double_support", "7.3": "push_single_support",
            "7.4": "contact_transition", "7.5": "unknown_surface"}
MEANINGS = (
    ("7.1", "COM motion", "com_motion_max"),
    ("7.1", "drift", "com_motion_reference_max com_difference_max"),
    ("7.1", "F_x", "foot_tangential_force_computed_max foot_yaw_moment_computed_max"),
    ("7.2", "COM error", "com_error_max_y"),
    ("7.2", "balancing", "balancing_first balancing_last"),
    ("7.2", "CoP", "cop_max_y cop_measured_max_y"),
    ("7.3", "COM error", "com_error_max_y"),
    ("7.3", "foot", "left_foot_error_max_y"),
    ("7.3", "balancing", "balancing_first"),
    ("7.4", "torque step", "torque_step_at_switch torque_step_at_switch_reference torque_step_ratio"),
    ("7.4", "motion", "foot_lift_motion_z foot_lift_motion_z_reference"),
    ("7.5", "sink", "left_foot_sink"),
    ("7.5", "balancing", "balancing_first balancing_last"),
    ("7.5", "M_y", "left_foot_pitch_violation_after_contact"),
    ("7.5", "rotation", "body_rotation_x_max_first_double body_rotation_x_max_last_double"),
)


def meant(label):
    """Section and metrics of a row "7.2 COM error, lateral"."""
    for section, word, metrics in MEANINGS:
        if label.startswith(section) and word in label:
            return section, metrics.split()
    return None, []


@reads("experiments", "All five stand")
def _(task):
    made = task.command(task.told())
    figures = {section: made.summary(scenario)[0] for section, scenario in SECTIONS.items()}
    section = ""

    def row(i, first, cells):
        nonlocal section
        section = first or section
        if section == "all":
            task.put(i, "ours", sum(f["violated_ticks"] for f in figures.values()))
            return
        metrics = meant(f"{section} {cells[1]}")[1]
        values = [figures[section].get(metric) for metric in metrics]
        if "below" in cells[2]:
            values[0] = GIVEN
        if metrics:
            task.put(i, "ours", *values)

    task.each(row)


@reads_row("experiments", "Joint friction takes")
def _(task, i, _, cells):
    task.put(i, 1, task.command(task.told(), flags(cells)).table("limits.csv")[0]["sim.push[0].peak"])


@reads_row("experiments", "In 7.5 M_y")
def _(task, i, _, cells):
    figures = task.command(task.told(), f"--inline --no-reference {flags(cells)}").summary()[0]
    put_each(task, i, 1, [figures], "left_foot_pitch_violation_after_contact", "left_foot_roll_violation_after_contact")


@reads_row("experiments", "A block 5 cm")
def _(task, i, first, _):
    told = task.told() if "`" in first else task.told().replace(" --variant NAME", "")
    made = task.command(told, "--inline --no-reference", NAME=re.findall(r"`(\w+)`|$", first)[0])
    for event in made.summary()[1]["events"]:
        if event["name"] == "touch_down":
            task.put(i, "touch-down", event["time"])
            task.put(i, "left sole", re.search(r"([\d.]+) mm above", event["detail"])[1])


@reads_row("experiments", "Of 300 blocks")
def _(task, i, _, cells):
    rows = task.command(task.told(), f"{flags(cells)} --column violated_ticks --column com_error_end").table()
    task.put(i, "stand", len(stands(rows)))
    task.put(i, "with a condition", sum(v > 0 for v in column(rows, "violated_ticks")))
    task.put(i, "COM behind", sum(v > 20 for v in column(stands(rows), "com_error_end")))


@reads("engines", "All 95 checks")
def _(task):
    rows = task.command(task.told()).table("worlds.csv")
    figures = {(r["scenario"], r["engine"], r["metric"]): r["measured"] for r in rows}

    def row(i, first, cells):
        section, metrics = meant(first)
        for engine in ("ODE", "MuJoCo"):
            task.put(i, engine, *(figures.get((SECTIONS.get(section), engine.lower(), m)) for m in metrics))

    task.each(row)


@reads("engines", "Of a thousand")
def _(task):
    ode, mujoco = (task.command(command).table() for command in task.claim.commands())
    task.put(0, 0, len(ode))
    task.put(0, 1, sum(a["outcome"] == b["outcome"] for a, b in zip(ode, mujoco)))
    task.put(0, 2, sum(a["outcome"] == b["outcome"] == "stands" for a, b in zip(ode, mujoco)))


@reads_row("engines", "Both step")
def _(task, i, first, cells):
    if "world_step" in cells[-1]:
        text = task.command(task.told("build/")).text
        for place, world in ((2, "ode"), (3, "mujoco")):  # its last time is the processor's
            task.put(i, place, re.search(rf"^{world}/\S+\s+[\d.]+ us\s+([\d.]+) us", text, re.M)[1])
        task.lack(i, "dWorldStep is in no engine of today", 1)
        return
    told = re.findall(r"`(poise [^`]*)`", cells[-1])
    if not told:  # "the same with --robot"
        told = [task.told("poise run stand").replace("heron/heron", "g1/g1" if "G1" in first else "tocabi/tocabi")]
    for place, world in ((2, "ode"), (3, "mujoco")):
        processor = statistics.median(task.command(told[0], f"--world {world} --seed {n}").processor for n in (1, 2, 3))
        task.put(i, place, processor, 10 / processor)
    task.lack(i, "dWorldStep is in no engine of today", 1)


@reads_row("estimation", "The filter knows")
def _(task, i, first, _):
    made = task.command(task.told(), "--inline --no-reference")
    run, _ = made.summary(re.search(r"`(\w+)`", first)[1])
    for place, name in enumerate(("position", "velocity", "tilt"), 1):
        task.put(i, place, run[f"estimator_{name}_rms"], run[f"estimator_{name}_max"])
    put_each(task, i, 4, [run], "estimator_nees_share")
    put_each(task, i, 5, [run], "estimator_nees_observable_share")


@reads("estimation", "With other gears")
def _(task):
    metrics = ("estimator_nees_share", "estimator_nees_observable_share", "estimator_position_rms")
    stiffness = "sim.drive_train.gear_stiffness"

    def make(place, scenario):
        rows = task.command(task.told(), " ".join(f"--column {m}" for m in metrics), SCENARIO=scenario).table()
        for i in task.rows():
            gear = float(re.match(r"\S+", task.claim.rows[i][0])[0])
            mine = [row for row in rows if row[stiffness] == gear]
            nees, observable, position = ([row[m] for row in mine] for m in metrics)
            task.put(i, place, min(nees), min(observable), max(position))

    each_column(task, SECTIONS.values(), make)


@reads_row("estimation", "With its load known")
def _(task, i, _, cells):
    for place, limit in enumerate(task.command(task.told(), flags(cells)).table("limits.csv"), 1):
        task.put(i, place, limit["sim.push[0].peak"])


@reads_row("estimation", "A load is found")
def _(task, i, first, cells):
    if first.startswith("Talos"):
        raise NotMade("its command is not on the page: poise sweep push has no load by itself")
    when = re.search(r"(\d) s", first)
    end = "end" if not when or when[1] == "6" else "2s"
    runs = [task.command(task.told(), f"--inline --no-reference {flags(cells)} --seed {seed}".replace("  ", " ")).summary()[0]
            for seed in (1, 2, 3)]
    mass, x, y, z = (max((run[f"{metric}_{end}"] for run in runs), key=abs) for metric in
                     ("mass_error", "com_estimate_error_x", "com_estimate_error_y", "com_estimate_error_z"))
    task.put(i, "mass", mass)
    task.put(i, "COM x, y", x, y)
    task.put(i, "COM z", z)
    x, y = ([abs(run[f"imu_tilt_{axis}_{end}"]) for run in runs] for axis in "xy")
    task.put(i, "IMU", min(x), max(x), -min(y), -max(y))


@reads_row("foot_wrenches", "A foot sensor that fails")
def _(task, i, first, _):
    kind, force = first.split()[0].upper(), re.search(r"[−+]\d+", first)
    bias = f" --set sim.foot_sensor_fault[0].force_z={force[0].replace('−', '-')}" if force else ""
    for place, told, start in ((1, task.told(), 0.2), (2, task.told("poise run unknown"), 10)):
        made = task.command(told, f"--inline --no-reference --set sim.foot_sensor_fault[0].foot=left --set "
                                  f"sim.foot_sensor_fault[0].kind={kind} --set sim.foot_sensor_fault[0].start={start}{bias}")
        noticed = [e["time"] for e in made.summary()[1]["events"] if e["name"] == "foot_sensor_fault"]
        if not noticed:
            task.lack(i, "the fault was not noticed", place)
            continue
        late = noticed[0] - start
        if " ms" in task.claim.rows[i][place]:
            late *= 1000
        task.put(i, place, *[late, GIVEN][:1 + task.claim.rows[i][place].count("20 ms")])


@reads("foot_wrenches", "Of 300 touch-downs")
def _(task):
    rows = task.command(task.told()).table()
    delays = column(rows, "touch_down_delay_max")
    task.put(0, "stood", len(stands(rows)))
    task.put(0, "late", sum(v <= 10 for v in delays))
    for place, share in ((3, 0.5), (4, 0.9), (5, 1)):
        task.put(0, place, quantile(delays, share))
    for i in (1, 2):
        task.lack(i, "which of the runs are meant is not in the table")


@reads_row("foot_wrenches", "Without sensors")
def _(task, i, first, _):
    if "the three" in first:
        raise NotMade("its row is of three commands")
    scenario, seeds = re.findall(r"`(\w+)", first)[0], re.search(r"(\d) seeds", first)
    told = task.told().replace("seed=1:6:6", f"seed=1:{seeds[1]}:{seeds[1]}" if seeds else "seed=1")
    more = ""
    if scenario == "push":
        told = told.replace(" --variant no_foot_sensors", "")
        more = f"--set robot={robot(first.partition(', ')[2])} --set sim.foot_sensors=false"
    elif "sim.foot_sensors" in first:
        told, more = told.replace(" --variant no_foot_sensors", ""), "--set sim.foot_sensors=false"
    rows = task.command(told, more, SCENARIO=scenario).table()
    most = [max(column(rows, f"observer_{name}")) for name in ("force_rms", "force_max", "cop_rms", "cop_max")]
    task.put(i, "force", *most[:2])
    task.put(i, "centre", *most[2:])
    task.put(i, "NEES", min(column(rows, "observer_nees_share")))
    delays = column(rows, "touch_down_delay_max")
    if delays:
        task.put(i, "touch-down", min(delays), max(delays))


@reads_row("pushes", "`best_strategy` stands 0.9")
def _(task, i, first, cells):
    rows = pushes(task, first, cells[1])
    peak, impulse, share = (column(rows, name) for name in ("sim.push[0].peak", "impulse", "share_of_lip"))
    task.put(i, "N", min(peak), max(peak))
    task.put(i, "N·s", min(impulse), max(impulse))
    task.put(i, "share", statistics.mean(share), min(share))


@reads_row("pushes", "Ahead (0°)")
def _(task, i, first, _):
    limits = pushes(task, "`best_strategy`" if first.startswith("best") else "the paper's", first.split(", ")[1])
    for place, limit in enumerate(limits, 1):
        task.put(i, place, limit["share_of_lip"])


def pushes(task, who, support):
    """Limits by direction of what the row says."""
    base = task.told("poise limit push_directions_double")
    told = base if support == "double" else base.replace("double", "single")
    more = ("--variant best_strategy --set sim.push[0].point.y=0" if "best" in who
            else "--set contact_wrench_monitor.balancing=false" if "off" in who else "")
    return task.command(told, more).table("limits.csv")


@reads_row("pushes", "No push that stood")
def _(task, i, first, _):
    told = task.told(f"poise sweep capture_point_{'double' if 'double' in first else 'single'}")
    rows = task.command(told, "--variant best_strategy" if "best" in first else "").table()
    stood, fell = stands(rows), [row for row in rows if row["outcome"] != "stands"]
    warnings = [w for w in column(fell, "step_warning_time") if w > 0]
    task.put(i, "stand", len(stood))
    task.put(i, "falls", len(warnings), len(fell))
    task.put(i, "false", sum(v > 0 for v in column(stood, "step_needed_time")), len(stood))
    task.put(i, "median", statistics.median(warnings))


@reads_row("pushes", "The whole benchmark")
@reads_row("pushes", "The quick benchmark")
@reads_row("pushes", "In ODE both robots")
def _(task, i, first, _):
    made = task.command(task.told("poise benchmark"), NAME=robot(first))
    rows = made.table("benchmark.csv")
    part = {name: [r for r in rows if r["part"] == name] for name in ("push_double", "push_single", "blocks", "lost", "late")}
    place = 1
    for name in ("push_double", "push_single"):
        points = [r for r in part[name] if r["point"] not in ("mean", "least")]
        for key, times in (("impulse_per_mass", 1), ("share_of_lip_of_duration", 100)):
            values = [r[key] * times for r in points]
            task.put(i, place, statistics.mean(values), min(values))
            place += 1
    stood = made.table("parts/blocks/table.csv")
    task.put(i, place, len(stands(stood)), len(stood))
    for name in ("lost", "late"):
        place += 1
        task.put(i, place, min(r["value"] for r in part[name] if r["point"] not in ("mean", "least")))


@reads("gains", "On soft blocks")
def _(task):
    task.lack(0, "the gains of hard ground are not on the page")
    points = [*range(1, 9), *range(31, 39), *range(81, 89)]

    def make(place, name):
        rows = task.command(task.told(), NAME=name).table("parts/blocks/table.csv")
        task.put(1, place, sum(rows[point - 1]["outcome"] == "stands" for point in points))

    each_column(task, ("heron/heron", "g1/g1"), make)


FEEDBACK = "--set redistributor.feedback.enabled=true"


@reads_row("redistribution", "Feedback takes")
def _(task, i, first, _):
    scenario = re.findall(r"`(\w+)`", first)[0]
    for place, more in ((1, ""), (2, FEEDBACK), (3, f"{FEEDBACK} --set redistributor.feedback.integral=25")):
        figures = task.command(task.told(), more, SCENARIO=scenario).table()[0]
        task.put(i, place, *(figures[f"foot_force_error_{part}rms"] for part in ("", "internal_", "resultant_")), figures["torque_step_max"])


@reads_row("redistribution", "The survivable push")
def _(task, i, first, _):
    more = f"--variant best_strategy {FEEDBACK}" if "best" in first else FEEDBACK
    limits = task.command(task.told(), more).table("limits.csv")
    for place, direction in ((1, 0), (2, 4), (3, 8)):  # of 16
        task.put(i, place, limits[direction]["sim.push[0].peak"])


@reads("soft_ground", "Of 1,000 courses")
def _(task):
    rows = task.command(task.told(), "--column violated_ticks --column torque_step_max --column steps").table()
    stood = stands(rows)
    fell = [row for row in rows if row["outcome"] == "fell"]
    times, feet = column(fell, "fell_at"), column(fell, "steps")
    broken, steps = column(stood, "violated_ticks"), column(stood, "torque_step_max")
    for i, values in enumerate((
            (len(stood), len(rows), 100 * len(stood) / len(rows)), (sum(v == 0 for v in broken), max(broken)),
            (statistics.median(steps), max(steps)), (len(fell), min(times), max(times), statistics.median(times)),
            (min(feet), max(feet), statistics.median(feet), sum(feet) / len(fell)))):
        task.put(i, 1, *values)
    task.lack(5, "the first trouble is told in words that have changed")


@reads("soft_ground", "Balancing by the least change")
def _(task):
    counts = [len(stands(task.command(task.told(), flags(cells)).table())) for cells in task.claim.rows]
    task.put(0, 1, counts[0])
    task.put(1, 1, counts[1], 48, 100 * sum(counts) / 64, 64)


@reads("soft_ground", "Firm courses")
def _(task):
    more = "--column violated_ticks --column torque_step_max"
    runs = [task.command(task.told(), f"{flags(task.claim.rows[0][:1])} {more}", K=f"{k}e3").table() for k in (10, 5, 3)]
    clean = [sum(row["violated_ticks"] == 0 for row in stands(rows)) for rows in runs]
    steps = [max(column(stands(rows), "torque_step_max")) for rows in runs]
    task.put(0, 1, *(len(stands(rows)) for rows in runs), 16, *clean, *steps)
    firm = task.command(task.told("poise sweep walk_courses --variant firm"), more).table()
    task.put(1, 1, len(stands(firm)), len(firm), sum(column(firm, "violated_ticks")), max(column(firm, "torque_step_max")))
    task.lack(2, "which of the steps' figures are meant the row does not tell")


@reads("soft_ground", "Pushed on firm courses")
def _(task):
    for i, told in enumerate(task.claim.commands()):
        rows = task.command(told).table()
        key = next((k for k in rows[0] if "impulse" in k), None)
        if key is None:
            task.lack(i, "the table has no impulse")
            continue
        edge = 14.1 if i == 0 else 10
        low, high = ([row for row in rows if (row[key] <= edge) == below] for below in (True, False))
        task.put(i, 1, *((len(stands(rows)), len(rows), len(stands(low)), edge, len(stands(high)), len(high)) if i == 0 else
                         (len(stands(rows)), GIVEN, len(stands(low)), len(low), edge, len(stands(high)), len(high))))


@reads("soft_ground", "Stairs of 10 cm")
def _(task):
    for i, more in enumerate(("", "--variant down ")):
        for world in WORLDS:
            figures, _ = task.command(task.told("poise run walk_stairs"), f"{more}--world {world}").summary()
            task.put(i, 1, figures["steps"], figures["violated_ticks"], GIVEN)
    for i in task.rows():
        task.lack(i, "only the courses that are told are read")


@reads("soft_ground", "Below 5 kN/m")
def _(task):
    text = task.command(task.told()).text
    for place, stiffness in enumerate((2000, 3000, 5000, 7000), 1):
        shares = re.search(rf"^ *{stiffness} N/m and more: ([\d.]+) of the courses, ([\d.]+) if", text, re.M)
        for i in task.rows():
            task.put(i, place, shares[1 + i])


@reads_row("real_time", "The planner takes")
def _(task, i, _, cells):
    told = re.findall(r"`(poise [^`]*)`", cells[0])[0]
    times = [c["latency_us"] for world in WORLDS for c in task.command(told, f"--world {world}").summary()[1]["components"]
             if c["name"] == "step_planner"]
    task.put(i, "median", *sorted(t["median"] for t in times)[:1 + cells[1].count(" to ")])
    task.put(i, "99 %", *sorted(t["p99"] for t in times))
    task.lack(i, "how busy the machine is, is not a flag", 3)


@reads_row("speed", "A thousand runs")
def _(task, i, _, cells):
    told = re.findall(r"`([^`]+)`", cells[2])
    if i > 3:
        raise NotMade("installations and a cluster: run its row by hand")
    made = task.command(re.sub(" --out FOLDER", "", told[0]))
    task.put(i, "figure", *((made.seconds,), (GIVEN, made.seconds), (made.seconds, made.processor))[min(i, 2)])


STEP_ROWS = {"steps, N·s": "impulse", "no step, N·s": "impulse", "of m ω r": "share_of_lip", "of m ω (r + l": "share_of_step",
             "largest survived": "largest_survived_impulse", "T, s": "step_time", "l, m": "reach"}


@reads("steps", "From both feet")
@reads("steps", "On the right foot")
def _(task):
    """A row is a column of limits.csv, 16 directions across; a row that names no engine goes on with those above."""
    group, no_step = "", "--set step_planner.recovery.enabled=false --set step_planner.hip_strategy.enabled=true"

    def row(i, first, _):
        nonlocal group
        if re.match(r"MuJoCo|ODE", first):
            group = first
        label = next((v for k, v in STEP_ROWS.items() if k in first), None)
        changes = no_step if "no step" in group else ""
        limits = task.command(task.told("poise limit"), changes, W="ode" if "ODE" in group else "mujoco").table("limits.csv")
        for place, limit in enumerate(limits, 1):
            if limit[label] != "":
                task.put(i, place, limit[label])
    task.each(row)


@reads("steps", "Of 500 random")
def _(task):
    names = {}

    def make(place, started):
        feet, world = started
        rows = task.command(task.told().replace("_double", f"_{feet}"), W=world).table()
        stood, fell = stands(rows), [row for row in rows if row["outcome"] != "stands"]
        stepped = [row for row in stood if row["steps"] > 0]
        pair = lambda name: (quantile(column(stepped, name), 0.5), quantile(column(stepped, name), 0.9))  # noqa: E731
        names[place] = {
            "stand with": [len(stood)], "of these by": [len(stepped)],
            "fall, no step": [sum(row["steps"] == 0 for row in fell)], "fall after": [sum(row["steps"] > 0 for row in fell)],
            "of those that stand": pair("step_decision"), "to touch-down": pair("step_touch_down"),
            "largest torque": pair("torque_step_max"), "violated": pair("violated_ticks"),
            "time in which": pair("estimator_left_foot_slip_time") + pair("estimator_right_foot_slip_time")}

    each_column(task, [(feet, world) for feet in ("double", "single") for world in WORLDS], make)
    if 1 in names:  # without a step: MuJoCo alone
        for place, feet in ((1, "double"), (3, "single")):
            told = task.told().replace("_double", f"_{feet}").replace("--variant step", "--variant best_strategy")
            rows = task.command(told, W="mujoco").table()
            names[place]["stand by"] = [len(stands(rows)), len(rows)]

    def row(i, first, _):
        for place, figures in names.items():
            values = next((v for k, v in figures.items() if first.lstrip("`").startswith(k)), None)
            if values:
                task.put(i, place, *values)
    task.each(row)


@reads("steps_by_robot", "A foot is down")
def _(task):
    for place, (told, world) in enumerate(((t, w) for t in task.claim.commands() for w in ("ode", "mujoco")), 1):
        figures, _ = task.command(told, f"--no-reference --inline --world {world}").summary()
        for i, metric in enumerate(("step_decision", "step_touch_down", "foothold_margin_min", "violated_ticks")):
            task.put(i, place, figures[metric])


@reads_row("walking", "Six robots")
def _(task, i, first, _):
    figures = [task.command(task.told(), NAME=robot(first), W=world).summary()[0] for world in WORLDS]
    put_each(task, i, 1, figures, "steps", "walk_way", "walk_course_share", "walk_turn_share", "walk_cost_of_transport",
             "joint_torque_share", "violated_ticks")


@reads_row("walking", "G1 and the paper's robot walk")
def _(task, i, first, cells):
    figures = [task.command(task.told(), NAME=robot(first), W=world, V=cells[1]).summary()[0] for world in WORLDS]
    put_each(task, i, 2, figures, "walk_speed_max", "walk_course_share", "walk_cost_of_transport", "joint_torque_share",
             "violated_ticks")


@reads_row("walking", "Without compensated friction")
def _(task, i, first, _):
    for place, more in ((1, "--set redistributor.friction_compensation.share=0"), (2, "")):
        runs = [task.command(task.told(), more, NAME=robot(first), W=world).summary()[0] for world in WORLDS]
        task.put(i, place, *("falls" if run["fallen"] else run["walk_cost_of_transport"] for run in runs))


@reads_row("steps_by_robot", "G1 stands")
def _(task, i, first, _):
    rows = task.command(task.told(), NAME=robot(first)).table()
    sizes = sorted({row["size"] for row in rows}, key=float)
    for place, size in enumerate(sizes, 1):
        task.put(i, place, len(stands([row for row in rows if row["size"] == size])))
    task.put(i, 6, next(float(row["push_impulse"]) for row in rows if row["size"] == sizes[0]))


@reads_row("drives", "7.5 stands")
def _(task, i, _, cells):
    if i == 1:
        raise NotMade("needs root and two network interfaces: run its row by hand")
    figures, _ = task.command(task.told("deploy/run"), "--no-reference").summary()
    task.put(i, 1, figures["drive_torque_step"], figures["bus_frames_sent"], GIVEN)

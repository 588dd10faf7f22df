"""Figures of the force laws, as `osteon-haptic laws --json` computes them. Compares them with the reference page's
points of comparison: 1000 rpm, 1 mm/s, the whole point of the drill in bone."""
import json

# Density g/cm3 to thrust N; diameter mm to thrust N and torque N mm in cortical bone.
CHI_N = {0.3: 3.2, 0.5: 5.9, 1.0: 13.5, 1.8: 27.1, 2.0: 30.7}
ALLOTTA = {2.5: (41.8, 30.5), 3.2: (53.5, 49.9), 4.5: (75.2, 98.7), 7.94: (132.7, 307.0)}
# K_s = 5 R_u of cortical bone, N/mm2: the torque's required work for each mm3 of the hole.
ALLOTTA_ENERGY = 650.0
# Fitted to Chi at that point.
CORTICAL_N = 28.9
FITTED = ("spring-damper", "multi-point")


def percent(value, expected):
    return 100.0 * abs(value - expected) / expected


def point(points, law, **where):
    """The one point of a law at these values. Without it the figure has no value and is short."""
    found = [p for p in points if p["law"] == law and all(abs(p[key] - value) < 1e-9 for key, value in where.items())]
    if len(found) != 1:
        raise KeyError(f"{law} at {where}: {len(found)} points")
    return found[0]


def laws(run):
    run.say("force laws at their points of comparison")
    listed = json.loads(run.output("osteon-haptic", "laws", "--json"))
    points = listed["points"]
    chi = [percent(point(points, "chi", density_g_cm3=density)["force_n"], force) for density, force in CHI_N.items()]
    thrust, torque, energy = [], [], []
    for diameter, (force_n, torque_nmm) in ALLOTTA.items():
        at = point(points, "allotta", diameter_mm=diameter)
        thrust.append(percent(at["force_n"], force_n))
        torque.append(percent(at["torque_nmm"], torque_nmm))
        energy.append(abs(at["work_mj_per_mm3"] / ALLOTTA_ENERGY - 1.0))
    fitted = [percent(point(points, law)["force_n"], CORTICAL_N) for law in FITTED]
    inverse = [abs(p["feed_of_force_mm_per_s"] / p["feed_mm_per_s"] - 1.0) for p in points]
    ratio = point(points, "allotta", diameter_mm=3.2)["force_n"] / point(points, "chi", density_g_cm3=1.9)["force_n"]
    rows = [("law", "tool", "rpm", "mm/s", "g/cm3", "N", "N mm", "outside its range")]
    rows += [(p["law"], p["tool"], f"{p['spindle_rpm']:g}", f"{p['feed_mm_per_s']:g}", f"{p['density_g_cm3']:g}",
              f"{p['force_n']:.2f}", f"{p['torque_nmm']:.1f}", "yes" if p["outside_range"] else "no") for p in points]
    run.tables.append(("force laws, the whole point or edge in bone", rows))
    return {
        "laws_listed": (len(listed["laws"]), None),
        "laws_chi_error": (max(chi), None),
        "laws_allotta_thrust_error": (max(thrust), None),
        "laws_allotta_torque_error": (max(torque), None),
        "laws_allotta_energy_error": (max(energy), None),
        "laws_fitted_error": (max(fitted), None),
        "laws_inverse_error": (max(inverse), None),
        "laws_allotta_over_chi": (ratio, 1.85),
    }


GROUPS = {"laws": laws}

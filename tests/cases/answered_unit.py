"""The truth in the unit of the answer. Where nothing tells an actuator's gain, a diagnosis gives forces in the unit of u ("0.85 V of dry
friction"): r, y and u hold no newton. So it does with loads where it identifies a transfer function; those of a first-order plant are in the unit of y. The truth is compared
in that unit. What acts on u itself (a dead zone, backlash) is in its unit anyway."""
import os
import tomllib


def load(folder, name):
    path = os.path.join(folder, name)
    if not os.path.exists(path):
        return {}
    with open(path, "rb") as file:
        return tomllib.load(file)


def unknown_drive(folder):
    """(unit of u, drive per unit of u) where the plant is unknown to the diagnosis, and u's unit is no other signal's; else None."""
    stated, plant = load(folder, "loop.toml"), load(folder, "truth.toml").get("plant", {})
    units = stated.get("units", {})
    unit = units.get("u")
    gain = plant.get("gain") if plant.get("kind") == "first-order" else plant.get("actuator_gain")
    is_open = stated.get("plant", {}).get("kind") == "identify" and unit != units.get("y")
    return (unit, gain) if is_open and unit and gain else None


def truth_as_answered(true, parameter, drive, place):
    """A true number of a kind that acts at this place, in the unit in which this parameter of a diagnosis stands."""
    if place != "actuator" and drive and parameter.get("unit", "").split("/")[0].split(" ")[0] == drive[0]:
        return true / drive[1]
    return true

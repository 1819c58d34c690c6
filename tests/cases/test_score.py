"""The scorer on diagnoses and likelihoods written by hand. Run by `check`."""
import json
import os
import stat
import tempfile
import unittest

import answered_unit
import oracle
import score
import table


def found(*physics, verdict="missing_physics", place="plant"):
    return dict(verdict=verdict, place=place, physics=list(physics))


def named(kind, ties=(), **numbers):
    parameters = [dict(name=name, value=value, ci95=interval) for name, (value, interval) in numbers.items()]
    return dict(kind=kind, indistinguishable_from=list(ties), parameters=parameters)


def label(kind, also=None, there=(), silent=False, **params):
    return dict(kind=kind, also=also, there=list(there), silent=silent, params=params, place="plant", onset_s=0.0)


class Judge(unittest.TestCase):
    def test_a_name_is_right_alone_or_among_at_most_three_ties(self):
        coulomb = label("coulomb_friction", level=2.0)
        self.assertTrue(score.judge(found(named("coulomb_friction")), coulomb)["right"])
        self.assertTrue(score.judge(found(named("stribeck_friction", ["coulomb_friction"])), coulomb)["right"])
        many = ["coulomb_friction", "cogging", "backlash", "stiction"]
        self.assertFalse(score.judge(found(named("stribeck_friction", many)), coulomb)["right"])
        wrong = score.judge(found(named("cogging")), coulomb)
        self.assertTrue(wrong["decided"] and not wrong["right"])
        self.assertFalse(score.judge(found(verdict="undecided"), coulomb)["decided"])

    def test_a_force_that_no_newton_is_known_of_is_compared_in_the_unit_of_u(self):
        answer = named("coulomb_friction", level=(0.5, [0.45, 0.55]))
        answer["parameters"][0]["unit"] = "V"
        truth = label("coulomb_friction", level=15.0)
        self.assertEqual(score.judge(found(answer), truth, ("V", 30.0))["ci_covers"], [True])
        self.assertEqual(score.judge(found(answer), truth)["ci_covers"], [False])
        answer["parameters"][0]["unit"] = "N"
        self.assertEqual(score.judge(found(answer), truth, ("V", 30.0))["ci_covers"], [False])
        play = named("backlash", width=(2.7, [2.6, 2.8]))
        play["parameters"][0]["unit"] = "V"
        truth = dict(label("backlash", width=2.68), place="actuator")
        self.assertEqual(score.judge(found(play), truth, ("V", 30.0))["ci_covers"], [True])

    def test_a_load_on_an_unknown_plant_is_compared_in_the_unit_of_u_too(self):
        stated = '[units]\nu = "%"\ny = "degC"\n[plant]\nkind = "identify"\n'
        first_order = '[plant]\nkind = "first-order"\ngain = 0.8\n'
        with tempfile.TemporaryDirectory() as folder:
            for name, text in (("loop.toml", stated), ("truth.toml", first_order)):
                with open(os.path.join(folder, name), "w") as file:
                    file.write(text)
            drive = answered_unit.unknown_drive(folder)
        answer = named("periodic_load", amplitude=(1.5, [1.4, 1.6]))
        truth = dict(label("periodic_load", amplitude=1.2), place="disturbance")
        answer["parameters"][0]["unit"] = "%"
        self.assertEqual(score.judge(found(answer), truth, drive)["ci_covers"], [True])
        answer["parameters"][0]["unit"] = "degC"
        self.assertEqual(score.judge(found(answer), truth, drive)["ci_covers"], [False])

    def test_what_the_noise_truly_is_counts_neither_way(self):
        jumps = label("cogging", there=["load_step", "injected_signal"], amplitude=1.0)
        out = score.judge(found(named("load_step"), named("cogging")), jumps)
        self.assertTrue(out["right"] and out["named"] == "cogging")
        self.assertFalse(score.judge(found(named("load_step")), label("none", there=["load_step"]))["false_alarm"])
        self.assertTrue(score.judge(found(named("delay")), label("none", there=["load_step"]))["false_alarm"])
        located = found(verdict="located", place="disturbance")
        self.assertFalse(score.judge(located, label("none", there=["periodic_load"]))["false_alarm"])
        self.assertTrue(score.judge(located, label("none", there=["quantization"]))["false_alarm"])
        self.assertTrue(score.judge(located, label("none"))["false_alarm"])

    def test_an_effect_that_moves_nothing_may_be_named_or_not(self):
        silent = label("saturation", silent=True)
        self.assertFalse(score.judge(found(named("saturation")), silent)["false_alarm"])
        self.assertFalse(score.judge(found(verdict="no_mismatch"), silent)["false_alarm"])
        self.assertTrue(score.judge(found(named("delay")), silent)["false_alarm"])

    def test_second_effects_and_wrong_names_beside_a_right_one(self):
        two = label("backlash", also="load_ramp")
        self.assertTrue(score.judge(found(named("load_ramp"), named("backlash")), two)["both"])
        beside = score.judge(found(named("backlash"), named("delay")), two)
        self.assertTrue(beside["right"] and not beside["both"])
        self.assertEqual(beside["wrong_beside"], 1)

    def test_intervals_cover_also_with_the_other_sign_of_an_amplitude(self):
        cog = label("cogging", amplitude=2.0, period=0.5)
        out = score.judge(found(named("cogging", amplitude=(-2.1, [-2.3, -1.9]), period=(0.6, [0.55, 0.65]))), cog)
        self.assertEqual(out["ci_covers"], [True, False])
        self.assertAlmostEqual(out["param_error"], 0.2)


class Oracle(unittest.TestCase):
    def ask(self, truth, other, with_command=True):
        """What the oracle says with a drift that gives these likelihoods."""
        with tempfile.TemporaryDirectory() as folder:
            for name, value in (("truth.toml", truth), ("improved.toml", other)):
                with open(os.path.join(folder, name), "w") as file:
                    file.write(str(value))
            tool = os.path.join(folder, "drift")
            answer = f'{{"{oracle.KEY}": %s}}'
            with open(tool, "w") as file:
                file.write('#!/bin/sh\nset -e\n[ "$1" = likelihood ]\nwhile [ $# -gt 0 ]; do case $1 in --loop) l=$2;; --json) j=$2;; esac; shift; done\n'
                           f"printf '{answer}' \"$(cat \"$l\")\" > \"$j\"\n" if with_command else "#!/bin/sh\nexit 2\n")
            os.chmod(tool, stat.S_IRWXU)
            return oracle.oracle([tool], folder)

    def test_the_three_reasons(self):
        self.assertEqual(self.ask(110.0, 100.0), ("search", 10.0))
        self.assertEqual(self.ask(70.0, 100.0), ("simulator", -30.0))
        self.assertEqual(self.ask(101.0, 100.0), ("information", 1.0))

    def test_without_the_command_nothing_is_said(self):
        self.assertEqual(self.ask(1.0, 2.0, with_command=False), ("-", None))

    def test_only_misses_are_asked_about(self):
        self.assertTrue(oracle.missed(dict(label="cogging", decided=True, right=False)))
        self.assertTrue(oracle.missed(dict(label="none", false_alarm=True)))
        self.assertFalse(oracle.missed(dict(label="cogging", decided=True, right=True)))
        self.assertFalse(oracle.missed(dict(label="cogging", error="refused")))


class Table(unittest.TestCase):
    def test_the_figures_are_those_of_the_cases(self):
        case = dict(know="model", excite="usual", family="axis", seconds=1.0)
        cases = [dict(case, label="cogging", decided=True, right=True, ci_covers=[True] * 30), dict(case, label="delay", decided=True, right=False, ci_covers=[False] * 10),
                 dict(case, label="delay", decided=False), dict(case, label="none", false_alarm=True), dict(case, label="none", false_alarm=False)]
        text = "\n".join(table.main_table(cases))
        for line in ("| wrong of named | 2 % | 1 of 2 (50.0 %) |", "| false alarms on clean ones | 1 % | 1 of 2 (50.0 %) |", "| right of all: model | 92 % | 1 of 3 (33.3 %) |",
                     "| coverage of the 95 % intervals | 90-99 % | 75 % of 40 |"):
            self.assertIn(line, text)


if __name__ == "__main__":
    unittest.main()

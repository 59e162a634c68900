"""The paper's figures: each shows the run's numbers."""
import unittest

import numpy as np
import poise

try:
    import matplotlib
    matplotlib.use("Agg")
except ImportError:
    matplotlib = None


@unittest.skipIf(matplotlib is None, "python3-matplotlib is not installed")
class Plots(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pushed = poise.run("push_double_support", duration=1.2)

    def line(self, figure, label, axes=0):
        return next(line for line in figure.axes[axes].lines if line.get_label() == label).get_xydata()

    def test_com_error_is_the_metric(self):
        figure = poise.plots.com_error(self.pushed)
        lateral = self.line(figure, "lateral")
        checked = lateral[lateral[:, 0] >= 0, 1]
        self.assertAlmostEqual(np.nanmax(np.abs(checked)), self.pushed.metric("com_error_true_max_y"), delta=0.01)

    def test_cop_stays_at_its_limit(self):
        figure = poise.plots.cop(self.pushed)
        cop = self.line(figure, "with balancing", 1)
        limit = self.line(figure, "limit", 1)
        self.assertLess((np.abs(cop[:, 1]) - limit[:, 1]).max(), 1e-3)
        self.assertGreater(np.abs(self.line(figure, "task torque alone", 1)[:, 1]).max(), limit[:, 1].max())

    def test_feet_carry_the_robot(self):
        figure = poise.plots.foot_forces(self.pushed)
        time, right = self.line(figure, "true", 0).T
        left = self.line(figure, "true", 1)[:, 1]
        weight = self.pushed.robot.total_mass * 9.80665
        before = (time > 0.05) & (time < 0.25)  # of the push, which has no vertical part
        self.assertAlmostEqual((right + left)[before].mean(), weight, delta=0.01 * weight)

    def test_the_others_draw(self):
        for plot in (poise.plots.load_share, poise.plots.foot_cop, poise.plots.push, poise.plots.torques):
            figure = plot(self.pushed)
            self.assertTrue(all(len(axes.lines) > 0 and axes.get_ylabel() for axes in figure.axes))
            figure.canvas.draw()
        self.assertEqual(len(poise.plots.torques(self.pushed, joints=self.pushed.joint_names[:2]).axes[0].lines), 2)
        with self.assertRaises(ValueError):
            poise.plots.torques(self.pushed, joints=["tail"])


if __name__ == "__main__":
    unittest.main()

"""Tests of the regenerated draws against the published table, and of the formula at points calculated by hand."""

import unittest

import streams

# runs 1-5, 6-10, … of the recorded experiments: y + 0.35, shift of the visibility, offset of the failures
PUBLISHED = (
    (2.805, 84.661587, +46.391795),
    (3.150, 9.618445, -8.810824),
    (3.283, 40.242093, -38.118814),
    (2.554, 22.631390, -30.599109),
    (3.313, 114.732078, +11.079933),
    (3.168, 77.825149, -75.181344),
)


class Draws(unittest.TestCase):
    def test_draws_are_the_published_ones(self) -> None:
        for found, (y, shift, offset) in zip(streams.draws(), PUBLISHED, strict=True):
            self.assertAlmostEqual(found.y + 0.35, y, places=3)
            self.assertAlmostEqual(found.shift, shift, places=6)
            self.assertAlmostEqual(found.offset, offset, places=6)

    def test_visibility(self) -> None:
        self.assertAlmostEqual(streams.visibility(0, 0), 3.75)
        self.assertAlmostEqual(streams.visibility(30, 0), 2.5)
        self.assertAlmostEqual(streams.visibility(60, 0), 1.25)
        self.assertAlmostEqual(streams.visibility(20, 100), 3.75)

    def test_failures(self) -> None:
        failures = {
            stream.name: [(round(s.second, 3), int(s.value)) for s in stream.stimuli if s.kind == "failure"]
            for stream in streams.published()
        }
        self.assertEqual(len(failures), 18)
        self.assertEqual(failures["exp1/draw1"], [(146.392, 1)])  # the second one would be at 292.8 s
        self.assertEqual(failures["exp3/draw6"], [(24.819, 1), (49.637, 3)])
        self.assertEqual(failures["exp2/draw6"], [])


if __name__ == "__main__":
    unittest.main()

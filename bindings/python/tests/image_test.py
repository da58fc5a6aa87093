"""Fluoroscopic images against closed forms."""

import numpy as np

import amontons as am
from scenes import Case, ball, main, tube_and_wire

CAMERA = am.Camera(source=(0, -1, 0), target=(0, 0, 0), width=0.1)


def lengths(image, attenuation, white=200.0):
    return -np.log(image / white) / attenuation


class ImageTest(Case):
    def test_a_thick_wire_darkens_by_its_chords(self):
        # Its middle by the diameter; at x pixels from it by the chord there.
        r, attenuation = 0.01, 40
        image = am.xray([[-1, 0, 0], [1, 0, 0]], CAMERA, (400, 400), attenuation=attenuation, noise=0, radius=r)
        column = lengths(image[:, 200].astype(float), attenuation)
        z = (np.arange(400) - 199.5) * 0.1 / 400
        chord = 2 * np.sqrt(np.maximum(0, r**2 - z**2))
        inside = np.abs(z) < 0.9 * r
        np.testing.assert_allclose(column[inside], chord[inside], rtol=0.03)
        self.assertTrue((column[np.abs(z) > 1.1 * r] == 0).all())
        np.testing.assert_array_equal(image, image[:, ::-1])
        np.testing.assert_array_equal(image[:, 100], image[:, 300])

    def test_the_volume_is_kept_however_thin_and_however_it_runs(self):
        # Sum of mean lengths times a pixel's area: volume times the square of the magnification.
        for points, radius, size, magnified in (
                ([[-0.02, 0, 0], [0.02, 0, 0]], 0.0004, 256, 1), ([[-0.02, 0, 0], [0.02, 0, 0]], 0.0004, 32, 1),
                ([[0, -0.01, 0], [0, 0.01, 0]], 0.002, 64, 1), ([[-0.01, -0.5, 0], [0.01, -0.5, 0.01]], 0.001, 64, 2)):
            image = am.xray(points, CAMERA, (size, size), attenuation=1, white=255e0, noise=0, radius=radius)
            self.assertEqual(image.dtype, np.uint8)
            a, b = np.array(points)
            volume = np.pi * radius**2 * np.linalg.norm(b - a) * magnified**2
            area = (0.1 / size) ** 2
            # Greys are whole numbers: so strong that they report, so weak that none is black.
            peak = volume / area
            attenuation = min(200.0, 400.0 / peak) if peak > 1 else 100.0
            for factor in (attenuation,):
                image = am.xray(points, CAMERA, (size, size), attenuation=factor, white=255, noise=0, radius=radius)
                if (image == 0).any():
                    factor /= 10
                    image = am.xray(points, CAMERA, (size, size), attenuation=factor, white=255, noise=0, radius=radius)
                found = lengths(np.maximum(image, 1).astype(float), factor, 255).sum() * area
                self.assertLess(abs(found / volume - 1), 0.1, (points, size))

    def test_crossing_wires_multiply(self):
        one = am.xray([[-1, 0, 0], [1, 0, 0]], CAMERA, (101, 101), attenuation=100, noise=0, radius=0.004)
        both = am.xray([[-1, 0, 0], [1, 0, 0], [1, 0.1, 0], [-1, 0.1, 0]], CAMERA, (101, 101), attenuation=100, noise=0,
                       radius=0.004)
        near, middle = one[50, 50] / 200, both[50, 50] / 200
        self.assertLess(middle, near**1.8)

    def test_up_and_right_are_where_they_should_be(self):
        high_right = am.xray([[0.02, 0, 0.03], [0.021, 0, 0.03]], CAMERA, (50, 50), noise=0, radius=0.002)
        rows, columns = np.nonzero(high_right < 200)
        self.assertLess(rows.max(), 25)  # above the middle
        self.assertGreater(columns.min(), 25)  # a source at -y points along +y: x is to the right
        behind = am.xray([[0, -2, 0], [0.1, -2, 0]], CAMERA, (50, 50), noise=0, radius=0.01)
        self.assertTrue((behind == 200).all())

    def test_noise_is_seeded_and_has_its_size(self):
        line = [[5, 0, 5], [6, 0, 5]]  # out of sight
        image = am.xray(line, CAMERA, (200, 200), noise=5, seed=3, radius=0.001)
        self.assertAlmostEqual(image.mean(), 200, delta=0.1)
        self.assertAlmostEqual(image.std(), np.sqrt(25 + 1 / 12), delta=0.1)
        np.testing.assert_array_equal(image, am.xray(line, CAMERA, (200, 200), noise=5, seed=3, radius=0.001))
        self.assertTrue((image != am.xray(line, CAMERA, (200, 200), noise=5, seed=4, radius=0.001)).any())

    def test_images_of_simulations_and_batches_are_those_of_their_lines(self):
        batch = am.Batch(tube_and_wire(), 2)
        with self.assertRaises(RuntimeError):
            am.xray(batch, CAMERA)
        batch.advance(6)
        camera = am.Camera((0.03, -1, 0.02), (0.03, 0, 0.02), 0.12)
        images = am.xray(batch, camera, (84, 84), noise=0)
        self.assertEqual(images.shape, (2, 84, 84))
        np.testing.assert_array_equal(images[0], images[1])
        beam = batch.simulations[0].record.beams["wire"]
        line = am.xray(beam.points, camera, (84, 84), noise=0, radius=beam.fields["radius"][0])
        np.testing.assert_array_equal(images[0], line)
        self.assertTrue((line < 200).any())

    def test_what_is_no_camera_is_refused(self):
        line = [[0, 0, 0], [1, 0, 0]]
        for camera, place in ((am.Camera((0, 0), (0, 0, 0), 1), "source"), (am.Camera((0, 0, 1), (0, 0, 0), 1), "up"),
                              (am.Camera((0, 1, 0), (0, 0, 0), 0), "width"), (am.Camera((0, 0, 0), (0, 0, 0), 1), "up"),
                              (am.Camera("abc", (0, 0, 0), 1), "camera")):
            with self.refused(place):
                am.xray(line, camera, radius=1)
        for options, place in (({"size": 3}, "size"), ({"size": (0, 1)}, "size"), ({"noise": -1}, "noise"), ({"radius": 0}, "radius"),
                               ({"attenuation": float("nan")}, "attenuation")):
            with self.refused(place):
                am.xray(line, CAMERA, **{"radius": 0.1, **options})
        with self.refused("what"):
            am.xray([1, 2, 3], CAMERA, radius=1)


class NearTheSource(Case):
    def test_a_wire_before_the_source_takes_no_longer_and_hides_what_is_behind(self):
        import time
        camera = am.Camera((0, 0, 0), (0, 1, 0), 0.1)
        begin = time.process_time()
        for width in (0.1, 1e-6):
            near = am.Camera((0, 0, 0), (0, 1, 0), width)
            # 1 mm of wire, 2 mm before the source: it covers the film 500 times over.
            image = am.xray([[-0.5, 0.002, 0], [0.5, 0.002, 0]], near, (64, 64), attenuation=1e5, noise=0, radius=0.001)
            self.assertEqual(image.max(), 0)
        along = am.xray([[0, 0.0011, 0], [0, 2, 0]], camera, (64, 64), attenuation=1e5, noise=0, radius=0.001)
        self.assertEqual(along[32, 32], 0)
        self.assertLess(time.process_time() - begin, 10)

    def test_what_is_cut_off_by_the_film_darkens_the_rest_as_before(self):
        camera = am.Camera((0, -1, 0), (0, 0, 0), 0.1)
        whole = am.xray([[-0.04, 0, 0], [0.04, 0, 0]], camera, (101, 101), attenuation=100, noise=0, radius=0.004)
        longer = am.xray([[-40, 0, 0], [40, 0, 0]], camera, (101, 101), attenuation=100, noise=0, radius=0.004)
        self.assertLessEqual(np.abs(whole[:, 20:80].astype(int) - longer[:, 20:80]).max(), 1)


if __name__ == "__main__":
    main()

"""Pictures: reading gives what was written, a failure leaves no file, errors name the file in one sentence."""

import numpy as np
import pytest
from PIL import Image

from pointshade_gl.files.pictures import picture_files as pictures
from pointshade_gl.files.pictures.picture_files import check_writable, normals_to_rgb, read_image, save_image

RNG = np.random.default_rng(3)
RGBA = RNG.integers(0, 256, (5, 7, 4), dtype=np.uint8)


@pytest.mark.parametrize("shape", [(7, 5), (7, 5, 3), (7, 5, 4), (1, 1, 4), (1, 9), (9, 1, 3)])
@pytest.mark.parametrize("small", [False, True])
def test_png_keeps_every_value(tmp_path, shape, small):
    image = np.random.default_rng(4).integers(0, 256, shape, np.uint8)
    save_image(tmp_path / "a.png", image, small=small)
    with Image.open(tmp_path / "a.png") as read:
        assert read.mode == {2: "L", 3: "RGB", 4: "RGBA"}[shape[2] if len(shape) == 3 else 2]
        assert (np.asarray(read) == image).all()


def test_a_large_png_is_the_same_whether_threads_can_be_started_or_not(tmp_path, monkeypatch):
    image = np.random.default_rng(4).integers(0, 256, (403, 401, 4), np.uint8)
    save_image(tmp_path / "a.png", image)
    with Image.open(tmp_path / "a.png") as read:
        assert (np.asarray(read) == image).all()

    def no_thread(*_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr("threading.Thread.start", no_thread)
    save_image(tmp_path / "b.png", image)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_small_png_is_smaller(tmp_path):
    v, u = np.mgrid[0:200, 0:300]
    image = np.where((u // 20 + v // 20) % 2, u // 2, 255 - v)[..., None].astype(np.uint8).repeat(3, -1)
    sizes = []
    for small in (False, True):
        save_image(tmp_path / "a.png", image, small=small)
        sizes.append((tmp_path / "a.png").stat().st_size)
    assert sizes[1] < sizes[0]


@pytest.mark.parametrize("suffix", [".png", ".webp", ".tif", ".tiff", ".PNG"])
@pytest.mark.parametrize("image", [RGBA, RGBA[..., :3], RGBA[..., 0]], ids=["rgba", "rgb", "grey"])
def test_lossless_formats_give_back_what_was_saved(tmp_path, suffix, image):
    path = tmp_path / f"image{suffix}"
    save_image(path, image)
    back = read_image(path)
    if suffix == ".webp" and image.ndim == 2:
        image = np.repeat(image[..., None], 3, axis=2)  # WebP has no grey
    assert back.dtype == np.uint8
    np.testing.assert_array_equal(back, image)


def test_npy_keeps_any_array_and_its_type(tmp_path):
    normals = RNG.normal(size=(4, 6, 3)).astype(np.float32)
    save_image(tmp_path / "normals.npy", normals)
    back = np.load(tmp_path / "normals.npy")
    assert back.dtype == np.float32
    np.testing.assert_array_equal(back, normals)


def test_jpeg_gets_the_picture_over_black(tmp_path):
    image = np.full((16, 16, 4), 200, np.uint8)
    image[:, :8, 3], image[:, 8:, 3] = 0, 255
    save_image(tmp_path / "image.jpg", image)
    back = read_image(tmp_path / "image.jpg")
    assert back.shape == (16, 16, 3)
    assert back[:, :6].max() <= 8
    assert np.abs(back[:, 10:].astype(int) - 200).max() <= 8


def test_pictures_that_are_slices_of_others_are_saved_as_seen(tmp_path):
    save_image(tmp_path / "image.png", RGBA[::-1, ::2])
    np.testing.assert_array_equal(read_image(tmp_path / "image.png"), RGBA[::-1, ::2])


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "image.png"
    save_image(path, RGBA)

    def break_off(self, file, *args, **options):
        file.write(b"half a picture")
        raise OSError("No space left on device")

    monkeypatch.setattr(Image.Image, "save", break_off)
    with pytest.raises(OSError, match="No space left"):
        save_image(path, RGBA[::-1], small=True)
    np.testing.assert_array_equal(read_image(path), RGBA)
    assert [file.name for file in tmp_path.iterdir()] == ["image.png"]


def test_a_new_file_has_the_usual_permissions(tmp_path):
    (tmp_path / "usual").touch()
    save_image(tmp_path / "image.png", RGBA)
    assert (tmp_path / "image.png").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_saving_over_a_link_replaces_its_target(tmp_path):
    (tmp_path / "link.png").symlink_to(tmp_path / "image.png")
    save_image(tmp_path / "link.png", RGBA)
    assert (tmp_path / "link.png").is_symlink()
    np.testing.assert_array_equal(read_image(tmp_path / "image.png"), RGBA)


def test_a_link_that_leads_nowhere_is_no_place_for_a_picture(tmp_path):
    (tmp_path / "loop.png").symlink_to(tmp_path / "back.png")
    (tmp_path / "back.png").symlink_to(tmp_path / "loop.png")
    with pytest.raises(OSError, match=r"loop\.png is a link that leads back to itself"):
        check_writable(tmp_path / "loop.png")
    (tmp_path / "lost.png").symlink_to(tmp_path / "missing" / "image.png")
    with pytest.raises(FileNotFoundError, match=r"cannot write .+lost\.png: there is no folder .+missing"):
        save_image(tmp_path / "lost.png", RGBA)


@pytest.mark.parametrize("ending", [KeyboardInterrupt, SystemExit])
def test_an_interrupted_save_leaves_nothing(tmp_path, monkeypatch, ending):
    def end(*_):
        raise ending

    monkeypatch.setattr(pictures, "encode_png", end)
    with pytest.raises(ending):
        save_image(tmp_path / "image.png", RGBA)
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_named_and_not_made(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no folder .*missing, create it first"):
        save_image(tmp_path / "missing" / "image.png", RGBA)
    assert not (tmp_path / "missing").exists()


@pytest.mark.parametrize("name", ["image.xyz", "image", ".png"])
def test_an_unknown_suffix_lists_the_known_ones(tmp_path, name):
    with pytest.raises(ValueError, match=r"must be one of \.png, \.jpg, .*\.npy"):
        check_writable(tmp_path / name)


def test_a_folder_is_not_overwritten(tmp_path):
    (tmp_path / "image.png").mkdir()
    with pytest.raises(IsADirectoryError, match="it is a folder"):
        save_image(tmp_path / "image.png", RGBA)


@pytest.mark.parametrize("shape", [(4,), (4, 5, 2), (0, 5, 3), (1, 4, 5, 3)])
def test_what_is_no_picture_is_refused(tmp_path, shape):
    with pytest.raises(ValueError, match=r"image must have shape \(h, w\)"):
        save_image(tmp_path / "image.png", np.zeros(shape, np.uint8))


def test_other_types_than_uint8_are_refused(tmp_path):
    with pytest.raises(TypeError, match="image must be uint8, got float64: scale it"):
        save_image(tmp_path / "image.png", np.zeros((4, 5, 3)))
    with pytest.raises(TypeError, match="image must be an array of numbers, got object"):
        save_image(tmp_path / "image.npy", [None])


def test_sizes_that_a_format_cannot_hold_are_refused(tmp_path):
    with pytest.raises(ValueError, match="up to 65500 pixels a side in JPEG"):
        save_image(tmp_path / "image.jpg", np.zeros((1, 65501), np.uint8))


def test_a_palette_is_looked_up_with_its_transparency(tmp_path):
    picture = Image.new("P", (2, 1))
    picture.putpalette([10, 20, 30, 200, 100, 50])
    picture.putpixel((1, 0), 1)
    picture.save(tmp_path / "opaque.png")
    picture.save(tmp_path / "cut.png", transparency=0)
    assert read_image(tmp_path / "opaque.png").tolist() == [[[10, 20, 30], [200, 100, 50]]]
    assert read_image(tmp_path / "cut.png").tolist() == [[[10, 20, 30, 0], [200, 100, 50, 255]]]


def test_deep_grey_keeps_its_values_in_either_byte_order(tmp_path):
    deep = RNG.integers(0, 65536, (5, 7), dtype=np.uint16)
    Image.fromarray(deep).save(tmp_path / "little.tif")
    Image.fromarray(deep.astype(">u2")).save(tmp_path / "big.tif")
    for name in ("little.tif", "big.tif"):
        back = read_image(tmp_path / name)
        assert back.dtype == np.uint16 and back.dtype.isnative
        np.testing.assert_array_equal(back, deep)


def test_a_picture_is_turned_as_its_camera_noted(tmp_path):
    exif = Image.Exif()
    exif[0x0112] = 6  # shown turned clockwise by a quarter
    Image.fromarray(RGBA[..., :3]).save(tmp_path / "turned.png", exif=exif)
    np.testing.assert_array_equal(read_image(tmp_path / "turned.png"), np.rot90(RGBA[..., :3], -1))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nothing\.png does not exist"):
        read_image(tmp_path / "nothing.png")


def test_a_folder_given_as_a_file_is_named(tmp_path):
    with pytest.raises(IsADirectoryError, match="is a folder, expected a file"):
        read_image(tmp_path)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", r"image\.png is empty"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git-LFS pointer.*run `git lfs pull`"),
        (b"hello, this is a letter\n" * 9, "is not a picture"),
    ],
    ids=["empty", "lfs", "text"],
)
def test_files_that_are_no_pictures(tmp_path, content, sentence):
    (tmp_path / "image.png").write_bytes(content)
    with pytest.raises(ValueError, match=sentence):
        read_image(tmp_path / "image.png")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".webp"])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_truncated_pictures_are_refused(tmp_path, suffix, share):
    path = tmp_path / f"image{suffix}"
    save_image(path, RNG.integers(0, 256, (64, 64, 3), dtype=np.uint8))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(ValueError, match=r"is a broken or truncated picture|is not a picture"):
        read_image(path)


def test_pictures_above_the_limit_are_refused_and_pillows_own_limit_does_not_count(tmp_path, monkeypatch):
    save_image(tmp_path / "image.png", RGBA)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 10)  # Pillow warns above this and raises above its double
    assert read_image(tmp_path / "image.png").shape == (5, 7, 4)
    assert Image.MAX_IMAGE_PIXELS == 10
    with pytest.raises(ValueError, match=r"image\.png has 7x5 pixels, the limit is 34: pass max_pixels=35 to allow it"):
        read_image(tmp_path / "image.png", max_pixels=34)


def test_normal_colours_are_the_usual_ones():
    towards, right, up = (0, 0, -1), (1, 0, 0), (0, -1, 0)
    image = normals_to_rgb(np.array([[towards, right, up, (np.nan, np.nan, np.nan)]], np.float32))
    assert image.dtype == np.uint8
    assert image.tolist() == [[[128, 128, 255, 255], [255, 128, 128, 255], [128, 255, 128, 255], [0, 0, 0, 0]]]


def test_normal_colours_need_three_floats():
    with pytest.raises(ValueError, match=r"normals must have shape \(h, w, 3\), got \(4, 5\)"):
        normals_to_rgb(np.zeros((4, 5)))
    with pytest.raises(TypeError, match="normals must be floating point, got uint8"):
        normals_to_rgb(np.zeros((4, 5, 3), np.uint8))

"""Invalid input of any kind: exit code 2 and one clear sentence, no traceback, no partial files."""

import io
import json
import sys

import pytest

from flarewright.cli.app import run

ROWS = """
rows = [
  { radius = 50.0, thickness = 5.0, glass = "N-BK7", n_d = 1.5168, v_d = 64.17, semi_diameter = 10.0 },
  { radius = -50.0, thickness = 2.0, semi_diameter = 10.0 },
  { stop = true, thickness = 80.0 },
]
"""
LENS = f'schema_version = 1\nname = "Singlet"\nf_number = 5.0\n{ROWS}'


def lens(**changes):
    """Return the valid lens file with texts replaced."""
    text = LENS
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    return text


LENS_FILES = {
    "empty": ("", "empty"),
    "not TOML": ("name = ", "not valid TOML"),
    "no version": (lens(a=("schema_version = 1\n", "")), "schema_version is missing"),
    "newer version": (lens(a=("schema_version = 1", "schema_version = 7")), "schema_version is 7"),
    "no f-number": (lens(a=("f_number = 5.0", "")), "f_number is missing"),
    "f-number is text": (lens(a=("f_number = 5.0", 'f_number = "fast"')), "f_number"),
    "f-number is nan": (lens(a=("f_number = 5.0", "f_number = nan")), "f_number is nan"),
    "no rows": (lens(a=(ROWS, "")), "rows is missing"),
    "no stop": (lens(a=("stop = true", 'radius = "flat"')), "no row is the stop"),
    "two stops": (lens(a=("radius = -50.0, thickness = 2.0, semi_diameter = 10.0", "stop = true")), "stop"),
    "no glass": (lens(a=('glass = "N-BK7", n_d = 1.5168, v_d = 64.17, ', "")), "no row has glass"),
    "unknown glass": (lens(a=('glass = "N-BK7", n_d = 1.5168, v_d = 64.17', 'glass = "UNOBTAINIUM"')), "UNOBTAINIUM"),
    "radius zero": (lens(a=("radius = 50.0", "radius = 0")), 'radius = "flat"'),
    "radius is text": (lens(a=("radius = 50.0", 'radius = "round"')), "row 0: radius"),
    "infinite thickness": (lens(a=("thickness = 5.0", "thickness = inf")), "row 0: thickness"),
    "negative semi-diameter": (lens(a=("semi_diameter = 10.0 },\n  { radius", "semi_diameter = -1 },\n  { radius")),
                               "row 0: semi_diameter"),
    "index below 1": (lens(a=("n_d = 1.5168", "n_d = 0.9")), "row 0: n_d"),
    "misspelt key": (lens(a=("thickness = 2.0", "thicknes = 2.0")), "did you mean 'thickness'"),
    "coating nonsense": (lens(a=("thickness = 2.0", 'thickness = 2.0, coating = "shiny"')), "shiny"),
    "asphere that is no list": (lens(a=("thickness = 2.0", "thickness = 2.0, asphere = 1e-6")), "row 1: asphere"),
    "decentre of one number": (lens(a=("thickness = 2.0", "thickness = 2.0, decentre = [1]")), "row 1: decentre"),
    "tilt beyond reason": (lens(a=("thickness = 2.0", "thickness = 2.0, tilt_deg = [0, 80]")), "at most 45"),
    "figure without terms": (lens(a=("thickness = 2.0", "thickness = 2.0, figure = {}")), "figure is empty"),
    "figure of a term that is none": (
        lens(a=("thickness = 2.0", "thickness = 2.0, figure = { zernike_nm = { 99 = 1 } }")), "'99' is no term"),
    "figure image that is not there": (
        lens(a=("thickness = 2.0", 'thickness = 2.0, figure = { image = "no.png", peak_valley_nm = 9 }')),
        "no.png does not exist; give"),
    "scatter that is no table": (LENS.replace("rows = [", "scatter = 1\nrows = [", 1), "scatter is 1"),
    "scatter of an unknown model": (LENS + '[scatter]\nmodel = "fog"\n', "scatter: model"),
    "scatter with a misspelt key": (LENS + "[scatter]\nroughnes_nm = 1\n", "did you mean 'roughness_nm'"),
    "element with the stop": (LENS + "[[elements]]\nrows = [1, 2]\n", "holds the stop"),
    "element out of range": (LENS + "[[elements]]\nrows = [0, 7]\n", "between 0 and 2"),
    "cylinder without power along y": (
        lens(a=("radius = 50.0", 'radius = "flat", radius_x = 50.0'), b=(
            "radius = -50.0", 'radius = "flat", radius_x = -50.0')), "afocal"),
    "positions without names": (LENS + "[[positions]]\ngaps = { 1 = 3.0 }\n", "position 0: name"),
    "positions without gaps": (LENS + '[[positions]]\nname = "wide"\n', "position 0: gaps"),
    "two positions for one setting": (
        LENS + '[[positions]]\nname = "a"\ngaps = { 1 = 3.0 }\nfocus_distance = 500\n[[positions]]\nname = "b"\n'
        "gaps = { 1 = 4.0 }\nfocus_distance = 500\n", "positions 'a' and 'b' are for one focal length"),
    "a gap that is glass": (LENS + '[[positions]]\nname = "a"\ngaps = { 0 = 3.0 }\n', "behind row 0 is glass"),
    "a gap behind no row": (LENS + '[[positions]]\nname = "a"\ngaps = { 7 = 3.0 }\n', "rows 0 to 1"),
    "positions of different gaps": (
        LENS.replace("stop = true", "stop = true").replace("thickness = 80.0 },", "thickness = 1.0 },\n"
        '  { radius = "flat", thickness = 9.0 },') + '[[positions]]\nname = "a"\ngaps = { 1 = 3.0 }\n[[positions]]\n'
        'name = "b"\ngaps = { 2 = 3.0 }\n', "the same gaps"),
    "preset too short": (LENS + '[coating_presets]\np = ["none"]\n', "preset 'p'"),
    "negative lens": (lens(a=("radius = 50.0", "radius = -50.0"), b=("radius = -50.0, thickness = 2.0",
                                                                     "radius = 50.0, thickness = 2.0")), "negative"),
}  # fmt: skip

PROJECT = 'lens = "heliar-tronnier"\n[[lights]]\nfield_deg = [10, 5]\n'

PROJECT_FILES = {
    "empty": ("", "empty"),
    "not TOML": ("lens", "not valid TOML"),
    "no lens": ("[[lights]]\nfield_deg = [1, 2]\n", "lens is missing"),
    "lights that are a number": (
        'lights = 3\nlens = "heliar-tronnier"\n',
        "lights should be tables, each under [[lights]], not 3",
    ),
    "a number without end": (PROJECT + f"intensity = 1{'0' * 5000}\n", "a number of thousands of digits in line 4"),
    "no light": ('lens = "heliar-tronnier"\n', "lights is missing: add at least one [[lights]]"),
    "key like no other": (PROJECT + "colour = 1\n", "lights[0].colour is not a known key; known are name, field_deg"),
    "newer version": ("schema_version = 2\n" + PROJECT, "newer"),
    "unknown lens": (PROJECT.replace("heliar-tronnier", "heliar-tronier"), "did you mean heliar-tronnier"),
    "lens file that is not there": (PROJECT.replace("heliar-tronnier", "no.toml"), "does not exist"),
    "misspelt key": ("f_numbr = 4\n" + PROJECT, "did you mean 'f_number'"),
    "key in the wrong place": ("blades = 4\n" + PROJECT, "belongs into [iris]"),
    "three angles": (PROJECT.replace("[10, 5]", "[10, 5, 1]"), "field_deg"),
    "light behind the camera": (PROJECT.replace("10", "100"), "lights[0].field_deg[0]"),
    "nan": (PROJECT.replace("10", "nan"), "finite"),
    "negative intensity": (PROJECT + "intensity = -1\n", "lights[0].intensity"),
    "unknown spectrum": (PROJECT + 'spectrum = "neon"\n', "lights[0].spectrum"),
    "spectrum file that is not there": (PROJECT + 'spectrum = "neon.csv"\n', "does not exist"),
    "unknown coating": ('coating = "quarter:550"\n' + PROJECT, "coating"),
    "unknown standard coating": (
        'coating = { kind = "everywhere", coating = { kind = "standard", name = "best" } }\n' + PROJECT,
        "coating.coating.name",
    ),
    "unknown preset": ('coating = "preset:gold"\n' + PROJECT, "gold"),
    "faster than the lens": ("f_number = 1.0\n" + PROJECT, "f/1 is faster"),
    "huge picture": (PROJECT + "[camera]\nsize_px = [100000, 10]\n", "between 1 and 32768"),
    "unknown quality": (PROJECT + '[quality]\nmode = "best"\n', "'draft', 'final' or 'reference'"),
    "error of nothing": (PROJECT + "[quality]\nreference_error = 0\n", "quality.reference_error should be greater"),
    "error of 1e-308": (
        PROJECT + "[quality]\nreference_error = 1e-308\n",
        "quality.reference_error should be greater than or equal to",
    ),
    "error of pixels": (PROJECT + '[quality]\nreference_error_of = "pixels"\n', "'total' or 'blocks'"),
    "three orders": (PROJECT + "[quality]\norders = 3\n", "quality.orders should be 2 or 4"),
    "limit zero": (PROJECT + "[quality]\norder4_limit = 0\n", "quality.order4_limit should be greater than 0"),
    "unknown ringing": (PROJECT + '[quality]\nringing = "fresnel"\n', "'off', 'collins' or 'frft'"),
    "ringing is a number": (PROJECT + "[quality]\nringing = 1\n", "quality.ringing"),
    "ringing in the wrong place": (PROJECT + '[output]\nringing = "frft"\n', "belongs into [quality]"),
    "no samples": (PROJECT + "[quality]\nreference_samples = 0\n", "quality.reference_samples should be greater"),
    "seed is negative": (PROJECT + "[quality]\nseed = -1\n", "quality.seed should be greater"),
    "two blades": (PROJECT + "[iris]\nblades = 2\n", "at least 3"),
    "rule without ghosts": (PROJECT + "[[art.rules]]\ngain = 2\n", "art.rules[0].select is missing"),
    "a word for a switch": (PROJECT + '[starburst]\ncats_eye = "yes"\n', "starburst.cats_eye"),
    "rule for nonsense": (PROJECT + '[[art.rules]]\nselect = "big"\n', "'big' chooses no ghosts"),
    "rule for a ghost that is not": (PROJECT + '[[art.rules]]\nselect = "5-1"\n', "has no ghost 5-1"),
    "rule for the stop's row": (PROJECT + '[[art.rules]]\nselect = "row:5"\n', "nothing reflects at row 5"),
    "negative gain": (PROJECT + '[[art.rules]]\nselect = "all"\ngain = -1\n', "art.rules[0].gain"),
    "infinite gain": (PROJECT + '[[art.rules]]\nselect = "all"\ngain = inf\n', "art.rules[0].gain"),
    "negative tint": (PROJECT + '[[art.rules]]\nselect = "all"\ntint = [1, -1, 0]\n', "art.rules[0].tint[1]"),
    "two tints": (PROJECT + '[[art.rules]]\nselect = "all"\ntint = [1, 1]\n', "art.rules[0].tint"),
    "two offsets": (PROJECT + '[[art.rules]]\nselect = "all"\noffset_px = [1, 1]\noffset_mm = [1, 1]\n', "keep one"),
    "ramp that falls": (
        PROJECT + '[[art.rules]]\nselect = "all"\nramp = [[1, 1, 1, 1], [0, 1, 1, 1]]\n',
        "positions must rise",
    ),
    "scale zero": (PROJECT + '[[art.rules]]\nselect = "all"\nscale = 0\n', "art.rules[0].scale"),
    "blur over the whole picture": (PROJECT + '[[art.rules]]\nselect = "all"\nblur_mm = 30\n', "more than an eighth"),
    "misspelt rule": (PROJECT + '[[art.rules]]\nselect = "all"\ngian = 2\n', "did you mean 'gain'"),
    "rule in the wrong place": (PROJECT + "[output]\nblur_px = 2\n", "belongs into [[art.rules]]"),
    "gain of an unknown pass": (PROJECT + "[art.gain]\nglow = 2\n", "there is no pass 'glow'"),
    "unknown scatter": (PROJECT + '[scatter]\nmodel = "fog"\n', "scatter.model should be 'none'"),
    "scatter that is too rough": (PROJECT + "[scatter]\nroughness_nm = 500\n", "scatter.roughness_nm should be less"),
    "scatter without end": (PROJECT + "[scatter]\nslope = 2\n", "scatter.slope should be greater"),
    "dust of no level": (PROJECT + "[scatter]\ncleanliness_level = 0\n", "scatter.cleanliness_level should be"),
    "two numbers of three": (PROJECT + "[scatter]\nabg = [1, 2]\n", "scatter.abg"),
    "share of more than all": (PROJECT + "[scatter]\nshare = 2\n", "scatter.share should be less"),
    "misspelt scatter": (PROJECT + "[scatter]\nroughnes_nm = 1\n", "did you mean 'roughness_nm'"),
    "scatter of the stop": (
        PROJECT + '[scatter]\nmodel = "abg"\n[[scatter.rows]]\nrow = 5\nshare = 0.1\n',
        "row 5 of Heliar",
    ),
    "scatter of a row that is not there": (
        PROJECT + '[scatter]\nmodel = "abg"\n[[scatter.rows]]\nrow = 50\n',
        "the last is 8",
    ),
    "a row that scatters twice": (
        PROJECT + "[scatter]\n[[scatter.rows]]\nrow = 1\n[[scatter.rows]]\nrow = 1\n",
        "row 1 appears 2 times",
    ),
    "more scatter than light": (PROJECT + '[scatter]\nmodel = "abg"\nabg = [5, 0.001, 2]\n', "reduce it"),
    "negative dust": (PROJECT + "[dirt]\ndust_per_mm2 = -1\n", "dirt.dust_per_mm2"),
    "dust sizes upside down": (PROJECT + "[dirt]\ndust_um = [50, 5]\n", "least diameter"),
    "opaque fingerprint": (PROJECT + "[dirt]\nfingerprint = 1.5\n", "dirt.fingerprint"),
    "negative seed": (PROJECT + "[dirt]\nseed = -1\n", "dirt.seed"),
    "misspelt dirt": (PROJECT + "[dirt]\ndust_per_mm = 1\n", "did you mean 'dust_per_mm2'"),
    "starburst without size": (PROJECT + "[starburst]\nsize = 0\n", "starburst.size"),
    "starburst turned too far": (PROJECT + "[starburst]\nspiral_deg = 360\n", "starburst.spiral_deg"),
    "rough without length": (PROJECT + "[iris]\nroughness_length_um = 0\n", "iris.roughness_length_um"),
    "light behind the lens": (PROJECT + "distance = -5\n", "lights[0].distance"),
    "disc and rectangle": (
        PROJECT + 'diameter_deg = 1\nshape = { kind = "rectangle", size_deg = [2, 1] }\n',
        "keep one",
    ),
    "rectangle of no height": (PROJECT + 'shape = { kind = "rectangle", size_deg = [2, 0] }\n', "size_deg[1]"),
    "polygon of two corners": (
        PROJECT + 'shape = { kind = "polygon", corners_deg = [[0, 0], [1, 1]] }\n',
        "corners_deg",
    ),
    "unknown shape": (PROJECT + 'shape = { kind = "star" }\n', "lights[0].shape"),
    "source parts of no size": (PROJECT + "[quality]\nsource_step_deg = 0\n", "quality.source_step_deg"),
    "light wider than the sky": (PROJECT + "diameter_deg = 200\n", "lights[0].diameter_deg"),
    "zoom of a prime": ("zoom = 50.0\n" + PROJECT, "has no positions"),
    "zoom below nothing": ("zoom = -3\n" + PROJECT, "zoom: -3 is no focal length; give one above 0"),
    "filter that is a number": ("filter = 3\n" + PROJECT, "filter"),
    "filter of no glass": ('filter = "X:2"\n' + PROJECT, "X"),
    "filter without thickness": ("filter = { gap = 2.0 }\n" + PROJECT, "filter.thickness is missing"),
    "filter with a misspelt key": ("filter = { thicknes = 2.0 }\n" + PROJECT, "did you mean 'thickness'"),
    "filter with a coating that is none": (
        'filter = { thickness = 2.0, coating = "shiny" }\n' + PROJECT,
        "filter.coating",
    ),
    "cover glass of no thickness": (PROJECT + "[camera]\ncover_glass = { thickness = 0 }\n", "cover_glass.thickness"),
    "sensor reflectance above 1": (PROJECT + "[camera]\nsensor_reflectance = 2\n", "sensor_reflectance"),
    "squeeze of 10": (PROJECT + "[camera]\nsqueeze = 10\n", "camera.squeeze"),
    "imperfection without a seed": (PROJECT + "[imperfection]\ndecentre_um = 5\n", "imperfection.seed is missing"),
    "ghosts moved beyond all sensors": (
        PROJECT + "[imperfection]\nseed = 1\nghost_offset_mm = 1e3\n",
        "imperfection.ghost_offset_mm",
    ),
    "imperfection below nothing": (
        PROJECT + "[imperfection]\nseed = 1\ntilt_arcmin = -1\n",
        "imperfection.tilt_arcmin",
    ),
    "holdout of nothing": (PROJECT + "[holdout]\noverscan = 2\n", "a holdout is an image or a depth plate"),
    "holdout with a misspelt key": (PROJECT + "[holdout]\nimages = 'a'\n", "did you mean 'image'"),
    "holdout that covers less than the picture": (
        PROJECT + "[holdout]\nimage = 'a.png'\noverscan = 0.5\n",
        "holdout.overscan",
    ),
    "a light's holdout of both kinds": (
        PROJECT + "holdout = { image = 'a.png', depth = 'a.exr' }\n",
        "lights[0].holdout",
    ),
    "coating is a number": (
        "coating = 7\n" + PROJECT,
        'coating: 7 is neither a text nor a table; write "lens", "none", "preset:NAME"',
    ),
    "sensor of three sides": (
        PROJECT + "[camera]\nsensor_mm = [36, 24, 1]\n",
        "camera.sensor_mm should be a list of 2, not 3",
    ),
    "tint of four colours": (
        PROJECT + '[[art.rules]]\nselect = "all"\ntint = [1, 1, 1, 1]\n',
        "art.rules[0].tint should be a list of 3, not 4",
    ),
    "negative sensor": (PROJECT + "[camera]\nsensor_mm = [-36, 24]\n", "above 0 mm"),
}

H = ["render", "heliar-tronnier"]
GOOD = ["--light", "10,5", "-o", "a.exr"]
G = ["ghosts", "heliar-tronnier", "--light", "1,1"]
REF = ["--quality", "reference"]

COMMAND_LINES = {
    "unknown command": (["rendre"], "no such command 'rendre'"),
    "no output": ([*H, "--light", "1,1"], "missing option '-o'"),
    "light at no distance": ([*H, *GOOD, "--distance", "0"], "--distance should be greater than 0"),
    "distance is nan": ([*H, *GOOD, "--distance", "nan"], "--distance should be a finite number"),
    "too many distances": (
        [*H, *GOOD, "--distance", "5", "--distance", "6"], "--distance is given 2 times for 1 light"),
    "moon": ([*H, "--light", "moon@1,1", "-o", "a.exr"], "there is no 'moon'"),
    "holdout that is not there": ([*H, *GOOD, "--holdout", "no.png"], "--holdout no.png does not exist"),
    "depth that is not there": ([*H, *GOOD, "--depth", "no.exr"], "--depth no.exr does not exist"),
    "holdout and depth": (
        [*H, *GOOD, "--holdout", "no.png", "--depth", "no.exr"], "--holdout and --depth both hide lights"),
    "rays from the moon": (
        [*H, *GOOD, *REF, "--rays-from", "moon"], "--rays-from should be 'auto', 'light' or 'camera'"),
    "sun nowhere": ([*H, "--light", "sun", "-o", "a.exr"], "--light sun@10,5"),
    "rectangle of words": ([*H, *GOOD, "--light-size", "big"], "--light-size 'big' is not two numbers"),
    "rectangle below zero": ([*H, *GOOD, "--light-size", "-1x2"], "--light-size"),
    "a sun of another shape": (
        [*H, "--light", "sun@1,1", "--light-size", "3x2", "-o", "a.exr"], "--light sun@X,Y is a disc already"),
    "one size too many beside a sun": (
        [*H, "--light", "sun@1,1", *GOOD, *["--light-size", "3x2"] * 2], "is given 2 times for 1 other light;"),
    "disc and rectangle": (
        [*H, *GOOD, "--light-size", "3x2", "--light-diameter", "1"], "each set the shape of lights; give one"),
    "polygon of two corners": ([*H, *GOOD, "--light-polygon", "0,0 1,0"], "has 2 corners; give three or more"),
    "polygon of words": ([*H, *GOOD, "--light-polygon", "0,0 1,0 x,1"], "--light-polygon 'x,1' is not two numbers"),
    "polygon that crosses itself": (
        [*H, *GOOD, "--light-polygon", "0,0 4,0 0,3 3,3"], "has edges that cross each other"),
    "rule without its words": ([*H, *GOOD, "--rule", "row:2"], "--rule 'row:2' is no rule; write --rule"),
    "rule with a strange word": ([*H, *GOOD, "--rule", "select='all', tin=[1,1,1]"], "did you mean 'tint'?"),
    "rule for no ghosts": ([*H, *GOOD, "--rule", "gain = 2"], "--rule: select is missing"),
    "rule of negative light": ([*H, *GOOD, "--rule", "select = 'all', gain = -2"], "--rule: gain should be greater"),
    "spiral beyond a quarter turn": ([*H, *GOOD, "--starburst-spiral", "100"], "--starburst-spiral should be less"),
    "colour of two numbers": ([*H, *GOOD, "--spectrum", "rgb:1,0"], "a colour is three numbers"),
    "black light": ([*H, *GOOD, "--spectrum", "rgb:0,0,0"], "a colour is three numbers"),
    "negative colour": ([*H, *GOOD, "--spectrum", "rgb:1,-1,0"], "a colour is three numbers"),
    "no lens": (["render", *GOOD], "no lens is given"),
    "no light": ([*H, "-o", "a.exr"], "no light is given"),
    "unknown flag": ([*H, *GOOD, "--glow"], "no such option: --glow"),
    "flag for an argument": (["render", "--lens", "heliar-tronnier", *GOOD], "LENS is written without --lens"),
    "unknown lens": (["render", "heliar-tronier", *GOOD], "did you mean heliar-tronnier"),
    "lens is a folder": (["render", ".", *GOOD], "folder"),
    "lens is a picture": (["render", "picture.png", *GOOD], "kind"),
    "light is one number": ([*H, "--light", "10", "-o", "a.exr"], "--light '10' is not two numbers"),
    "light is words": ([*H, "--light", "left,up", "-o", "a.exr"], "not two numbers"),
    "light is nan": ([*H, "--light", "nan,1", "-o", "a.exr"], "not two numbers"),
    "light behind": ([*H, "--light", "95,1", "-o", "a.exr"], "behind the camera"),
    "intensity is text": ([*H, *GOOD, "--intensity", "bright"], "'--intensity'"),
    "negative intensity": ([*H, *GOOD, "--intensity", "-1"], "--intensity"),
    "infinite intensity": ([*H, *GOOD, "--intensity", "inf"], "--intensity"),
    "intensity beyond every light": (
        [*H, *GOOD, "--intensity", "1e36"], "--intensity should be less than or equal to 1e+20, not 1e+36"),
    "three intensities": ([*H, *GOOD, *["--intensity", "1"] * 3], "3 times for 1 light"),
    "unknown spectrum": ([*H, *GOOD, "--spectrum", "neon"], "neon"),
    "cold black body": ([*H, *GOOD, "--spectrum", "black-body:5"], "between 500"),
    "f-number zero": ([*H, *GOOD, "--fstop", "0"], "--fstop"),
    "f-number is nan": ([*H, *GOOD, "--fstop", "nan"], "--fstop"),
    "too fast": ([*H, *GOOD, "--fstop", "1"], "f/1 is faster"),
    "two blades": ([*H, *GOOD, "--blades", "2"], "at least 3"),
    "a thousand blades": ([*H, *GOOD, "--blades", "1000"], "--blades"),
    "rounding 2": ([*H, *GOOD, "--rounding", "2"], "--rounding"),
    "no iris image": ([*H, *GOOD, "--iris-image", "no.png"], "no.png"),
    "unknown coating": ([*H, *GOOD, "--coating", "teflon"], "teflon"),
    "misspelt standard coating": ([*H, *GOOD, "--coating", "modern-brodband"], "did you mean 'modern-broadband'"),
    "standard coating as the lens' own": (
        [*H, *GOOD, "--coating", "preset:modern-broadband"], "leave out 'preset:'"),
    "plot no coating": (["coating", "plot"], "missing argument"),
    "plot an unknown coating": (["coating", "plot", "teflon"], "coating 'teflon' is not understood"),
    "plot on an unknown glass": (["coating", "plot", "none", "--glass", "N-BK77"], "N-BK77"),
    "plot on air": (["coating", "plot", "none", "--glass", "1"], "no index of a glass"),
    "plot on nan": (["coating", "plot", "none", "--glass", "nan"], "no index of a glass"),
    "plot a film eaten by its offset": (["coating", "plot", "quarter-wave:550-300"], "use an offset above"),
    "plot into a JPEG": (["coating", "plot", "none", "-o", "a.jpg"], "*.svg or *.png"),
    "plot into no folder": (["coating", "plot", "none", "-o", "no/a.svg"], "does not exist"),
    "an error of no reference": ([*H, *GOOD, "--error", "0.1"], "--error works with --quality reference only"),
    "samples of no reference": ([*H, *GOOD, "--samples", "999"], "--samples works with --quality reference only"),
    "solo of none": ([*H, *GOOD, "--solo", "largest:0"], "'largest:0' chooses no ghosts"),
    "mute nonsense": ([*H, *GOOD, "--mute", "big"], "--mute: 'big' chooses no ghosts"),
    "solo of a ghost that is not": ([*H, *GOOD, "--solo", "5-1"], "error: --solo 5-1: Heliar-Tronnier"),
    "mute of a row that is not": ([*H, *GOOD, "--mute", "row:77"], "error: --mute row:77: nothing reflects at row 77"),
    "gain of a ghost that is not": ([*H, *GOOD, "--mute", "7-6", "--gain", "5-1=2"], "error: --gain 5-1=2: Heliar"),
    "rule of a ghost that is not": (
        [*H, *GOOD, "--rule", "select = '5-1'"], "error: --rule \"select = '5-1'\": Heliar-Tronnier"),
    "rule of a wide blur": ([*H, *GOOD, "--rule", "select = 'all', blur_mm = 30"], "error: --rule: ghost "),
    "gain without a factor": ([*H, *GOOD, "--gain", "7-3"], "--gain '7-3' is no name and factor"),
    "gain of words": ([*H, *GOOD, "--gain", "7-3=much"], "is no name and factor"),
    "gain below zero": ([*H, *GOOD, "--gain", "7-3=-1"], "between 0 and 1e9"),
    "gain is nan": ([*H, *GOOD, "--gain", "7-3=nan"], "between 0 and 1e9"),
    "gain of an unknown pass": ([*H, *GOOD, "--gain", "glow=2"], "there is no pass 'glow'"),
    "gain of a nonsense row": ([*H, *GOOD, "--gain", "row:x=2"], "chooses no ghosts"),
    "f-number of many noughts": (
        [*H, *GOOD, "--fstop", "1e9"], "--fstop should be less than or equal to 256, not 1e+09"),
    "f-number a hair too large": (
        [*H, *GOOD, "--fstop", "256.0000001"], "--fstop should be less than or equal to 256, not 256.0000001"),
    "unknown preset": ([*H, *GOOD, "--coating", "preset:gold"], "gold"),
    "coating file missing": ([*H, *GOOD, "--coating", "no.toml"], "no.toml"),
    "unknown quality": ([*H, *GOOD, "--quality", "best"], "--quality should be 'draft', 'final' or 'reference'"),
    "no wavelengths": ([*H, *GOOD, "--wavelengths", "0"], "--wavelengths"),
    "error above 1": ([*H, *GOOD, *REF, "--error", "2"], "--error should be less than or equal to 1"),
    "error nan": ([*H, *GOOD, *REF, "--error", "nan"], "--error should be a finite number"),
    "error of pixels": ([*H, *GOOD, *REF, "--error-of", "pixels"], "--error-of should be 'total' or 'blocks'"),
    "no samples": ([*H, *GOOD, *REF, "--samples", "0"], "--samples should be greater than or equal to 1"),
    "half a sample": ([*H, *GOOD, *REF, "--samples", "0.5"], "'--samples'"),
    "negative seed": ([*H, *GOOD, *REF, "--seed", "-1"], "--seed should be greater than or equal to 0"),
    "six orders": ([*H, *GOOD, "--orders", "6"], "--orders should be 2 or 4"),
    "limit above 1": ([*H, *GOOD, "--orders", "4", "--order4-limit", "2"], "--order4-limit should be less than 1"),
    "no time": ([*H, *GOOD, *REF, "--time-limit", "0"], "--time-limit 0 is no time"),
    "time nan": ([*H, *GOOD, *REF, "--time-limit", "nan"], "--time-limit nan is no time"),
    "time for final quality": ([*H, *GOOD, "--time-limit", "5"], "works with --quality reference only"),
    "resume from nothing": ([*H, *GOOD, *REF, "--resume", "no.npz"], "no.npz does not exist"),
    "resume from a lens": ([*H, *GOOD, *REF, "--resume", "lens.toml"], "read as a state file of a reference render"),
    "size is one number": ([*H, *GOOD, "--size", "640"], "--size '640'"),
    "size is not whole": ([*H, *GOOD, "--size", "640.5x480"], "whole numbers"),
    "size zero": ([*H, *GOOD, "--size", "0x480"], "--size: 0x480"),
    "size huge": ([*H, *GOOD, "--size", "99999x99999"], "32768"),
    "sensor negative": ([*H, *GOOD, "--sensor", "-36x24"], "above 0 mm"),
    "disc tiny": ([*H, *GOOD, "--light-diameter", "1e-9"], "at least 1e-06 degrees, not 1e-09; 0 is a point"),
    "rectangle tiny": ([*H, *GOOD, "--light-size", "1e-9x1"], "1e-06"),
    "polygon tiny": ([*H, *GOOD, "--light-polygon", "0,0 1e-9,0 0,1e-9"], "has no area"),
    "sensor tiny": ([*H, *GOOD, "--sensor", "1e-308x24"], "too small for a sensor; give at least 0.001 mm a side"),
    "sensor of an airfield": (
        [*H, *GOOD, "--sensor", "1e9x1e9"], "--sensor: 1e+09x1e+09 mm is too large for a sensor; give at most"),
    "pixels like fields": (
        [*H, *GOOD, "--ideal", "--sensor", "1e6x1e6", "--size", "64x36", "--quality", "draft"],
        "pixels of 2.78e+04 mm are too coarse for the starburst, whose core has 0.084 mm; give a smaller --sensor"),
    "unknown layers": ([*H, *GOOD, "--layers", "all"], "--layers"),
    "unknown compression": ([*H, *GOOD, "--compression", "piz"], "--compression"),
    "brightest zero": ([*H, *GOOD, "--brightest", "0"], "--brightest"),
    "unknown colorspace": ([*H, *GOOD, "--colorspace", "nonsense"], "rec709"),
    "unknown view": ([*H, *GOOD, "--view", "log"], "--view 'log'"),
    "two exposures": ([*H, *GOOD, "--ev", "12", "--shutter", "1/50"], "--ev and --shutter"),
    "iso alone": ([*H, *GOOD, "--iso", "400"], "--iso needs --ev or --shutter"),
    "no shutter": ([*H, *GOOD, "--shutter", "1/0"], "--shutter '1/0'"),
    "no lux": ([*H, *GOOD, "--ev", "12", "--lux", "moon"], "1e+09; write it like 20000 or sun"),
    "preset without its word": ([*H, *GOOD, "--coating", "staggered"], "for the lens: lens, preset:NAME or a"),
    "empty lens": (["render", "", *GOOD], "no lens is given"),
    "empty folder of a gallery": (["gallery", "-o", ""], "the name of the output is empty"),
    "empty folder of a search": (["design", "solve", "lens.toml", "--output", ""], "the name of the output is empty"),
    "empty name of an output": (["gallery", "--output="], "the name of the output is empty"),
    "ev far out": ([*H, *GOOD, "--ev", "1e9"], "--ev"),
    "exposure nan": ([*H, *GOOD, "--exposure", "nan"], "--exposure"),
    "unknown paths": ([*H, *GOOD, "--paths", "some"], "--paths"),
    "ghosts of a light behind": (["ghosts", "heliar-tronnier", "--light", "1,1", "--distance", "-3"], "--distance"),
    "a sensor's ghost of no row": (
        ["lens", "show", "heliar-tronnier", "--plot", "a.svg", "--ghost", "sensor-99"], "sensor-99 is not a ghost",
    ),
    "focus behind": ([*H, *GOOD, "--focus", "-10"], "--focus"),
    "threads zero": ([*H, *GOOD, "--threads", "0"], "--threads"),
    "output is no EXR": ([*H, "--light", "1,1", "-o", "a.jpg"], "*.exr"),
    "output folder missing": ([*H, "--light", "1,1", "-o", "no/a.exr"], "does not exist"),
    "output is a folder": ([*H, "--light", "1,1", "-o", "folder.exr"], "it is a folder"),
    "project missing": (["render", "--project", "no.toml", "-o", "a.exr"], "no.toml does not exist"),
    "unknown scatter": ([*H, *GOOD, "--scatter", "fog"], "--scatter should be"),
    "negative polish": ([*H, *GOOD, "--surface-roughness", "-1"], "--surface-roughness"),
    "polish is nan": ([*H, *GOOD, "--surface-roughness", "nan"], "--surface-roughness"),
    "cleaner than clean": ([*H, *GOOD, "--cleanliness", "0"], "--cleanliness"),
    "scatter without glare": ([*G, "--scatter", "abg"], "add --glare"),
    "glare of unknown scatter": (
        ["ghosts", "lens.toml", "--light", "1,1", "--glare", "--scatter", "fog"], "--scatter should be"),
    "glare of negative polish": (
        ["ghosts", "lens.toml", "--light", "1,1", "--glare", "--surface-roughness", "-1"], "--surface-roughness"),
    "unknown ringing": ([*H, *GOOD, "--ringing", "on"], "--ringing should be 'off', 'collins' or 'frft'"),
    "negative dust": ([*H, *GOOD, "--dust", "-1"], "--dust"),
    "dust is nan": ([*H, *GOOD, "--dust", "nan"], "--dust"),
    "negative scratches": ([*H, *GOOD, "--scratches", "-1"], "--scratches"),
    "fingerprint 2": ([*H, *GOOD, "--fingerprint", "2"], "--fingerprint"),
    "negative roughness": ([*H, *GOOD, "--roughness", "-1"], "--roughness"),
    "seed below zero": ([*H, *GOOD, "--seed", "-1"], "--seed"),
    "no dirt image": ([*H, *GOOD, "--dirt-image", "no.png"], "no.png"),
    "two disc sizes for one light": ([*H, *GOOD, *["--light-diameter", "1"] * 2], "--light-diameter is given 2 times"),
    "disc is negative": ([*H, *GOOD, "--light-diameter", "-1"], "--light-diameter"),
    "zoom of a prime": ([*H, *GOOD, "--zoom", "50"], "has no positions"),
    "zoom beyond": (["render", "canon-70-200", *GOOD, "--zoom", "500"], "zooms from"),
    "zoom to a position that is none": (["render", "canon-70-200", *GOOD, "--zoom", "macro"], "no position 'macro'"),
    "zoom below nothing": (["render", "canon-70-200", *GOOD, "--zoom", "-5"], "not to -5 mm"),
    "filter without thickness": ([*H, *GOOD, "--filter", "N-BK7"], "--filter 'N-BK7' is no plate"),
    "filter of no glass": (
        [*H, *GOOD, "--filter", "UNOBTAINIUM:2"],
        "'UNOBTAINIUM' is not in the catalogue: give n_d and v_d instead (on the command line an index can replace "
        "the name",
    ),
    "filter of no thickness": ([*H, *GOOD, "--filter", "N-BK7:0"], "--filter 'N-BK7:0'"),
    "filter of thin air": ([*H, *GOOD, "--filter", "1.0:2"], "--filter '1.0:2'"),
    "cover glass that does not fit": ([*H, *GOOD, "--cover-glass", "N-BK7:90:40"], "does not fit behind"),
    "cover glass of words": ([*H, *GOOD, "--cover-glass", "thin"], "--cover-glass 'thin' is no plate"),
    "sensor brighter than light": ([*H, *GOOD, "--sensor-reflectance", "1.5"], "--sensor-reflectance"),
    "sensor reflectance nan": ([*H, *GOOD, "--sensor-reflectance", "nan"], "--sensor-reflectance"),
    "imperfection without a seed": ([*H, *GOOD, "--imperfection", "x"], "--imperfection 'x' is no sample"),
    "imperfection of too many parts": ([*H, *GOOD, "--imperfection", "1:2:3:4:5"], "is no sample"),
    "imperfection below nothing": ([*H, *GOOD, "--imperfection", "1:-5"], "--imperfection '1:-5'"),
    "ghosts moved by less than nothing": ([*H, *GOOD, "--ghost-offset", "-1"], "--ghost-offset"),
    "ghosts moved by nan": ([*H, *GOOD, "--ghost-offset", "nan"], "--ghost-offset"),
    "mute a mirror that is none": ([*H, *GOOD, "--mute", "sensor-8"], "while the sensor reflects nothing"),
    "mute a mirror's ghost at the stop": (
        [*H, *GOOD, "--mute", "sensor-5", "--sensor-reflectance", "0.1"], "has no ghost sensor-5"),
    "zoom to nan": (["render", "canon-70-200", *GOOD, "--zoom", "nan"], "not to nan mm"),
    "squeeze of nothing": ([*H, *GOOD, "--squeeze", "0"], "--squeeze"),
    "ghosts of a bright sensor": (["ghosts", "heliar-tronnier", "--light", "1,1", "--sensor-reflectance", "2"],
                                  "--sensor-reflectance should be less than or equal to 1"),
    "ghosts zoomed": (["ghosts", "heliar-tronnier", "--light", "1,1", "--zoom", "9"], "has no positions"),
    "show zoomed": (["lens", "show", "heliar-tronnier", "--zoom", "9"], "has no positions"),
    "several at once": ([*H, *GOOD, "--fstop", "0", "--quality", "best"], "2 settings cannot be used"),
    "ghosts of three orders": (["ghosts", "heliar-tronnier", "--light", "1,1", "--orders", "3"], "should be 2 or 4"),
    "ghosts below no limit": (["ghosts", "heliar-tronnier", "--light", "1,1", "--orders", "4", "--order4-limit", "nan"],
                              "--order4-limit should be a finite number"),
    "ghosts of two with a limit of four": (
        ["ghosts", "heliar-tronnier", "--light", "1,1", "--order4-limit", "1e-3"], "add --orders 4, or leave it out"),
    "focus and sensor distance": (
        [*H, *GOOD, "--focus", "900", "--sensor-distance", "80"], "--focus and --sensor-distance both place"),
    "blades beside an iris image": (
        [*H, *GOOD, "--iris-image", "picture.png", "--blades", "5"], "--blades shapes blades and"),
    "exposure of no PNG": ([*H, *GOOD, "--no-png", "--exposure", "1"], "--exposure is for the PNG and"),
    "view of no PNG": ([*H, *GOOD, "--no-png", "--view", "srgb"], "--view is for the PNG and"),
    "ghosts of two lights": ([*G, "--light", "2,2"], "--light is given 2 times; ghosts are listed for one light"),
    "ghosts focused twice": ([*G, "--focus", "900", "--sensor-distance", "80"], "keep one"),
    "iris image is a folder": ([*H, *GOOD, "--iris-image", "folder.exr"], "--iris-image folder.exr is a folder; give"),
    "output below a file": ([*H, "--light", "1,1", "-o", "lens.toml/a.exr"], "lens.toml is a file, not a folder"),
    "output without a name": ([*H, "--light", "1,1", "-o", ""], "the name of the output is empty"),
    "output is the folder above": ([*H, "--light", "1,1", "-o", ".."], "cannot write ..: it is a folder"),
    "output is an ending": ([*H, "--light", "1,1", "-o", ".exr"], "an ending without a name; write flare.exr"),
    "ghosts without a light": (["ghosts", "heliar-tronnier"], "no light is given; give its place in degrees"),
    "ghosts in X-rays": (["ghosts", "heliar-tronnier", "--light", "1,1", "--wavelength-nm", "1"], "not visible"),
    "ghosts too fast": (["ghosts", "heliar-tronnier", "--light", "1,1", "--fstop", "1"], "f/1 is faster"),
    "ghosts of unknown paths": (["ghosts", "heliar-tronnier", "--light", "1,1", "--paths", "x"], "--paths should be"),
    "show nothing": (["lens", "show"], "missing argument"),
    "show an unknown lens": (["lens", "show", "summicron"], "neither a shipped lens nor a file"),
    "show a ghost that is words": (["lens", "show", "heliar-tronnier", "--ghost", "bright"], "J-I"),
    "draw a ghost of the stop": (
        ["lens", "show", "heliar-tronnier", "--plot", "a.svg", "--ghost", "5-1"], "5-1 is not a ghost"),
    "draw into no folder": (["lens", "show", "heliar-tronnier", "--plot", "no/a.svg"], "does not exist"),
    "convert onto itself": (["lens", "convert", "lens.toml", "lens.toml"], "is the file to convert"),
    "convert onto another file": (["lens", "convert", "heliar-tronnier", "lens.toml"], "replace it with --force"),
    "a ghost to draw nowhere": (["lens", "show", "heliar-tronnier", "--ghost", "4-1"], "add --plot OUT.svg"),
    "a light to draw nowhere": (["lens", "show", "heliar-tronnier", "--light", "4,1"], "add --plot OUT.svg"),
    "convert to another kind": (["lens", "convert", "lens.toml", "a.seq"], "*.toml"),
    "init over a file": (["project", "init", "heliar-tronnier", "-o", "lens.toml"], "exists already"),
    "check a project that is a lens": (["project", "check", "lens.toml"], "is a lens file, not a project file"),
}  # fmt: skip


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.exr").mkdir()
    (tmp_path / "lens.toml").write_text(LENS)
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n\x00\x00")
    return tmp_path


def refuse(capsys, folder, words, *keywords):
    before = sorted(folder.iterdir())
    assert run(words) == 2
    out, err = capsys.readouterr()
    lines = err.splitlines()
    sentences = [line for line in lines if line.startswith("flarewright: error: ")]
    assert len(sentences) == 1, err
    assert "Traceback" not in out + err
    assert not sentences[0].endswith((".", ":", ";", ",")), sentences[0]
    # Below the sentence there is at most the list of all findings.
    assert all(line.startswith("  - ") for line in lines[lines.index(sentences[0]) + 1 :])
    for keyword in keywords:
        assert keyword in err
    assert sorted(folder.iterdir()) == before
    return out


def checked_and_rendered(cases):
    """Return each case with both commands. A render reads the file as the check does: most of them are slow tests."""
    checked = [pytest.param(case, "check", id=case) for case in cases]
    rendered = [
        pytest.param(case, "render", id=f"{case}, rendered", marks=[pytest.mark.slow] if number % 6 else [])
        for number, case in enumerate(cases)
    ]
    return [*checked, *rendered]


@pytest.mark.parametrize(("case", "command"), checked_and_rendered(LENS_FILES))
def test_lens_files(capsys, folder, case, command):
    text, keyword = LENS_FILES[case]
    (folder / "bad.toml").write_text(text)
    if command == "check":
        out = refuse(capsys, folder, ["lens", "check", "bad.toml"], keyword)
        assert out.startswith("bad.toml: rejected")
    else:
        assert refuse(capsys, folder, ["render", "bad.toml", "--light", "1,1", "-o", "a.exr"], keyword) == ""


@pytest.mark.parametrize(("case", "command"), checked_and_rendered(PROJECT_FILES))
def test_project_files(capsys, folder, case, command):
    text, keyword = PROJECT_FILES[case]
    (folder / "bad.toml").write_text(text)
    words = {"check": "project check bad.toml", "render": "render --project bad.toml -o a.exr"}[command]
    assert refuse(capsys, folder, words.split(), keyword) == ""


@pytest.mark.parametrize("case", COMMAND_LINES)
def test_command_lines(capsys, folder, case):
    words, keyword = COMMAND_LINES[case]
    assert refuse(capsys, folder, words, keyword) == ""


def test_a_rule_is_named_where_it_was_given(capsys, folder):
    rule = '[[art.rules]]\nselect = "{}"\ngain = 2\n'
    (folder / "good.toml").write_text(PROJECT + rule.format("7-6"))
    (folder / "bad.toml").write_text(PROJECT + rule.format("5-1"))
    words = ["render", "-o", "a.exr", "--project"]
    refuse(capsys, folder, [*words, "good.toml", "--solo", "5-1"], "error: --solo 5-1: Heliar-Tronnier")
    refuse(capsys, folder, [*words, "bad.toml", "--solo", "7-6"], "error: art.rules[0], '5-1': Heliar-Tronnier")


def test_every_finding_of_a_lens_file_is_listed_with_its_row(capsys, folder):
    text = LENS.replace("radius = 50.0", "radius = 0").replace("thickness = 2.0", 'thickness = "wide"')
    (folder / "bad.toml").write_text(text + "colour = 1\n")
    out = refuse(capsys, folder, ["lens", "check", "bad.toml"])
    assert "  - row 0: radius" in out
    assert "  - row 1: thickness" in out
    assert run(["lens", "show", "bad.toml"]) == 2
    assert capsys.readouterr().err.count("  - ") >= 2


def test_one_bad_file_is_reported_and_the_others_are_checked(capsys, folder):
    (folder / "bad.toml").write_text("")
    assert run(["lens", "check", "lens.toml", "bad.toml", "heliar-tronnier"]) == 2
    out, err = capsys.readouterr()
    assert [line.split(":")[1].split(",")[0] for line in out.splitlines() if line[0] != " "] == [
        " usable", " rejected", " usable"]  # fmt: skip
    assert "1 of 3 lens files were rejected" in err


@pytest.mark.parametrize("terminal", [True, False])
def test_a_check_of_many_files_shows_a_bar_on_terminals_only(folder, monkeypatch, capsys, terminal):
    class Screen(io.StringIO):
        def isatty(self):
            return terminal

    monkeypatch.setattr(sys, "stderr", screen := Screen())
    monkeypatch.setenv("TERM", "xterm")
    assert run(["lens", "check", *["lens.toml"] * 3]) == 0
    assert capsys.readouterr().out.count("lens.toml: usable") == 3
    assert ("lenses: lens.toml" in screen.getvalue()) == terminal
    assert ("0:00:0" in screen.getvalue() or "-:--:--" in screen.getvalue()) == terminal
    if not terminal:
        assert screen.getvalue() == ""


def test_all_errors_of_a_project_are_listed(capsys, folder):
    text = PROJECT + "intensity = -1\ndiameter_deg = 2\nshape = { kind = 'rectangle', size_deg = [2, 1] }\n"
    text += "[camera]\nsize_px = [0, 10]\n[iris]\nblades = 2\n[quality]\nwavelengths = 0\n"
    (folder / "bad.toml").write_text(text)
    assert run(["project", "check", "bad.toml"]) == 2
    err = capsys.readouterr().err
    places = ("lights[0].intensity", "lights[0].shape", "camera.size_px", "iris.blades", "quality.wavelengths")
    assert [err.count(f"  - {place}") for place in places] == [1] * 5
    assert err.count("  - ") == 5


def test_errors_of_a_render_are_listed_together(capsys, folder):
    text = 'coating = "preset:gold"\n' + PROJECT + '[iris]\nmask = "no.png"\n[dirt]\nimage = "nor.png"\n'
    (folder / "bad.toml").write_text(text + '[[art.rules]]\nselect = "5-1"\n')
    refuse(capsys, folder, ["project", "check", "bad.toml"], "bad.toml has 4 problems, the first: ", "  - ")


@pytest.mark.parametrize("kind", ["project", "scene"])
def test_why_a_file_is_refused_is_one_json_object_too(capsys, folder, kind):
    (folder / "bad.toml").write_text("colour = 1\n")
    out = json.loads(refuse(capsys, folder, [kind, "check", "bad.toml", "--json"], "colour"))
    assert (out["file"], out["usable"]) == ("bad.toml", False)
    assert any("colour" in problem for problem in out["problems"])
    out = json.loads(refuse(capsys, folder, [kind, "check", "no.toml", "--json"], "no.toml does not exist"))
    assert out["problems"] == [out["reason"]]


def test_an_iris_image_that_a_lens_file_names_is_looked_for(capsys, folder):
    (folder / "bad.toml").write_text(LENS + '[iris]\nmask = "nowhere.png"\n')
    refuse(capsys, folder, ["lens", "check", "bad.toml"], "nowhere.png does not exist; give the path of a PNG")


def test_a_binary_project_and_a_folder_as_project(capsys, folder):
    (folder / "bin.toml").write_bytes(bytes(range(256)))
    # "save it as UTF-8" does not help a user who gave a picture
    refuse(
        capsys, folder, ["project", "check", "bin.toml"], "bin.toml is no text in UTF-8 but other data: a project file"
    )
    (folder / "bin.toml").write_bytes('lens = "ä"'.encode("utf-16"))
    refuse(capsys, folder, ["project", "check", "bin.toml"], "save it as UTF-8")
    refuse(capsys, folder, ["project", "check", "."], "is a folder")


def test_dirt_that_cannot_be_drawn(capsys, folder):
    for image, keyword in (("no.png", "no.png does not exist"), ("picture.png", "cannot be read as an image")):
        (folder / "bad.toml").write_text(PROJECT + f'[dirt]\nimage = "{image}"\n[quality]\nmode = "draft"\n')
        refuse(capsys, folder, ["render", "--project", "bad.toml", "-o", "a.exr"], keyword)

"""Makes the two font files of this folder from Inter 4.1's `web/Inter-*.woff2` (npm package inter-ui 4.1.1).

    python3 subset.py FOLDER-WITH-WOFF2      # needs fonttools and brotli

Kept: Latin, Greek and Cyrillic letters, combining accents, punctuation and a few mathematical signs. Digits are
the tabular ones, so that numbers align in columns. Pair kerning of ASCII is moved from GPOS, which asks for a
shaper, to a plain `kern` table. Hints are dropped.
"""

import pathlib
import sys

from fontTools import subset
from fontTools.ttLib import TTFont, newTable
from fontTools.ttLib.tables._k_e_r_n import KernTable_format_0

RANGES = [
    (0x20, 0x7E), (0xA0, 0x17F), (0x218, 0x21B), (0x300, 0x30C), (0x327, 0x328), (0x386, 0x3CE), (0x400, 0x45F),
    (0x490, 0x491), (0x1E80, 0x1E85), (0x2010, 0x2027), (0x2030, 0x203A), (0x2070, 0x208E),
]  # fmt: skip
SIGNS = "\u1e9e\u1ef2\u1ef3\u20ac\u2113\u2116\u2122\u2190\u2191\u2192\u2193\u2202\u2206\u2211\u2212\u221a\u221e\u2248\u2260\u2264\u2265"


def kerning(font):
    """Unicode pair to advance, from the pair adjustments of the `kern` feature; the first that matches counts."""
    names = {code: name for code, name in font.getBestCmap().items() if 0x20 <= code < 0x7F}
    gpos = font["GPOS"].table
    lookups = sorted({i for f in gpos.FeatureList.FeatureRecord if f.FeatureTag == "kern" for i in f.Feature.LookupListIndex})
    tables = [t.ExtSubTable if t.LookupType == 9 else t for i in lookups for t in gpos.LookupList.Lookup[i].SubTable]
    tables = [t for t in tables if t.LookupType == 2]

    def advance(left, right):
        for table in tables:
            if left not in table.Coverage.glyphs:
                continue
            if table.Format == 1:
                records = table.PairSet[table.Coverage.glyphs.index(left)].PairValueRecord
                record = next((r for r in records if r.SecondGlyph == right), None)
                if record is None:
                    continue
            else:
                classes = table.ClassDef1.classDefs.get(left, 0), table.ClassDef2.classDefs.get(right, 0)
                record = table.Class1Record[classes[0]].Class2Record[classes[1]]
            return getattr(record.Value1, "XAdvance", 0) or 0
        return 0

    digits = range(0x30, 0x3A)
    pairs = {(a, b): advance(names[a], names[b]) for a in names for b in names if a not in digits and b not in digits}
    return {pair: value for pair, value in pairs.items() if abs(value) >= 12}


def make(source, target):
    font = TTFont(source)
    pairs = kerning(font)
    glyphs = set(font.getGlyphOrder())
    for table in font["cmap"].tables:
        for code in range(0x30, 0x3A):
            if code in table.cmap and table.cmap[code] + ".tf" in glyphs:
                table.cmap[code] += ".tf"
    options = subset.Options(layout_features=[], hinting=False, notdef_outline=True, recalc_timestamp=False)
    options.name_IDs = [0, 1, 2, 5, 13, 14]
    options.drop_tables += ["GSUB", "GPOS", "GDEF", "STAT", "DSIG", "meta", "gasp"]
    subsetter = subset.Subsetter(options)
    codes = {code for first, last in RANGES for code in range(first, last + 1)} | {ord(sign) for sign in SIGNS}
    subsetter.populate(unicodes=codes)
    subsetter.subset(font)
    names = font.getBestCmap()
    kern = KernTable_format_0()
    kern.version, kern.coverage, kern.tupleIndex, kern.apple = 0, 1, None, False
    kern.kernTable = {(names[a], names[b]): value for (a, b), value in pairs.items()}
    font["kern"] = newTable("kern")
    font["kern"].version, font["kern"].kernTables = 0, [kern]
    font.flavor = None
    font.save(target)


if __name__ == "__main__":
    here = pathlib.Path(__file__).parent
    for weight in ("Regular", "SemiBold"):
        make(pathlib.Path(sys.argv[1]) / f"Inter-{weight}.woff2", here / f"Inter-{weight}-subset.ttf")

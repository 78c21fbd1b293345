//! Kronrod's rule of 15 nodes, with Gauss' rule of 7 inside it, and the panels that it is applied to.
//!
//! Both rules integrate the same samples. If they agree, the sum of 15 is far more accurate than their
//! difference; if not, the panel is cut in two.

/// A node of the rule over [-1, 1].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) x: f64,
    /// The node's weight in Kronrod's rule of 15 nodes.
    pub(crate) kronrod: f64,
    /// The node's weight in Gauss' rule of 7 nodes; 0 for the others.
    pub(crate) gauss: f64,
}

pub(crate) const NODES: usize = 15;

/// The nodes from -1 to 1 (Piessens et al. 1983, QUADPACK, qk15).
pub(crate) const RULE: [Node; NODES] = {
    // The positive nodes from the outside in; every second one belongs to Gauss' rule too.
    const X: [f64; 8] = [
        0.991_455_371_120_812_6,
        0.949_107_912_342_758_5,
        0.864_864_423_359_769_1,
        0.741_531_185_599_394_4,
        0.586_087_235_467_691_1,
        0.405_845_151_377_397_2,
        0.207_784_955_007_898_47,
        0.0,
    ];
    const KRONROD: [f64; 8] = [
        0.022_935_322_010_529_224,
        0.063_092_092_629_978_56,
        0.104_790_010_322_250_18,
        0.140_653_259_715_525_92,
        0.169_004_726_639_267_9,
        0.190_350_578_064_785_4,
        0.204_432_940_075_298_9,
        0.209_482_141_084_727_82,
    ];
    const GAUSS: [f64; 4] =
        [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_119, 0.417_959_183_673_469_4];
    let mut rule = [Node { x: 0.0, kronrod: 0.0, gauss: 0.0 }; NODES];
    let mut i = 0;
    while i < NODES {
        let j = if i < 8 { i } else { NODES - 1 - i };
        let sign = if i < 8 { -1.0 } else { 1.0 };
        let gauss = if j % 2 == 1 { GAUSS[j / 2] } else { 0.0 };
        rule[i] = Node { x: sign * X[j], kronrod: KRONROD[j], gauss };
        i += 1;
    }
    rule
};

/// An interval to integrate over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Panel {
    pub(crate) from: f64,
    pub(crate) to: f64,
    /// The number of times that the panel has been halved.
    pub(crate) depth: usize,
}

impl Panel {
    /// Divides [from, to] into equal panels of at most `widest`.
    pub(crate) fn split(from: f64, to: f64, widest: f64) -> impl Iterator<Item = Self> {
        let count = ((to - from) / widest).ceil().max(1.0);
        let edge = move |i: usize| if i as f64 == count { to } else { from + (to - from) * i as f64 / count };
        (0..count as usize).map(move |i| Self { from: edge(i), to: edge(i + 1), depth: 0 })
    }

    /// Divides the panel into its two halves.
    pub(crate) fn halves(self) -> [Self; 2] {
        let middle = 0.5 * (self.from + self.to);
        let depth = self.depth + 1;
        [Self { to: middle, depth, ..self }, Self { from: middle, depth, ..self }]
    }

    /// Half the width of the panel, the scale of the rule's weights.
    pub(crate) fn radius(self) -> f64 {
        0.5 * (self.to - self.from)
    }

    /// The position of a node in the panel.
    pub(crate) fn at(self, node: Node) -> f64 {
        0.5 * (self.from + self.to) + self.radius() * node.x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gauss' 7 nodes are exact to degree 13, the 15 to degree 22; a sum of 15 terms of size one rounds at
    /// 1e-15.
    #[test]
    fn the_rules_are_exact_to_their_degrees() {
        for degree in 0..=22 {
            let expected = if degree % 2 == 1 { 0.0 } else { 2.0 / f64::from(degree + 1) };
            let sum =
                |weight: fn(&Node) -> f64| RULE.iter().map(|n| weight(n) * n.x.powi(degree)).sum::<f64>();
            assert!((sum(|n| n.kronrod) - expected).abs() < 2e-15, "{degree}");
            assert_eq!(
                (sum(|n| n.gauss) - expected).abs() < 2e-15,
                degree <= 13 || degree % 2 == 1,
                "{degree}"
            );
        }
    }

    #[test]
    fn panels_tile_their_interval() {
        let panels: Vec<_> = Panel::split(0.3, 1.7, 0.5).collect();
        assert_eq!(panels.len(), 3);
        assert_eq!((panels[0].from, panels[2].to), (0.3, 1.7));
        assert!(panels.windows(2).all(|pair| pair[0].to == pair[1].from));
        let [left, right] = panels[1].halves();
        assert_eq!((left.from, right.to, left.to), (panels[1].from, panels[1].to, right.from));
    }
}

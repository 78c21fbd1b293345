//! Results are the same bytes with any number of threads.

use engine::{Artifact, Digest};

use crate::relighting::{Baked, sky};
use crate::room::Room;

#[test]
fn threads_change_no_byte() {
    let digests = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let baked = Baked::of(&Room::new(), "paths = 64\nerror = 0.02\npaths-most = 1024");
            let probes = baked.lit("lamps = \"all\"", Some(&sky(1.7)));
            [
                Digest::of(&baked.scene.encode().unwrap()),
                Digest::of(&baked.transport.encode().unwrap()),
                Digest::of(&baked.lamps.encode().unwrap()),
                Digest::of(&probes.bytes),
            ]
        })
    };
    let one = digests(1);
    assert_eq!(digests(2), one);
    assert_eq!(digests(5), one);
}

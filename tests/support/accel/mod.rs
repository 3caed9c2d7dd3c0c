//! Primitives for the ray accelerator and the exact answers it is compared with, without scene descriptions.

mod aimed;
mod exact;
mod meshes;

use glam::{DVec3, Vec3};

use pointillist::tracer::accel::{Accel, Hit, PrimRange, Ray, Shapes, SimdKernel};
use pointillist::tracer::shape::{Cylinder, Disk, Sphere, Triangle};

pub use aimed::{Leaks, aimed, leaks};
pub use exact::{Tally, Verdict, check, check_verdicts, polygon, rounding};
pub use meshes::{CLOSED, Closed, icosphere, moeller_trumbore};
pub use pointillist::math::random::Random;

/// The answers to the two queries, closest hit and any hit.
pub type Answer = (Option<Hit>, bool);

/// The kernels that this processor can run, slowest first.
pub fn kernels() -> Vec<SimdKernel> {
    SimdKernel::ALL.into_iter().filter(|k| k.is_available()).collect()
}

/// A hit as bits: equal only when every digit is.
pub fn bits(hit: Option<Hit>) -> Option<[u32; 5]> {
    hit.map(|h| [h.t.to_bits(), h.prim, h.uv[0].to_bits(), h.uv[1].to_bits(), h.instance])
}

/// Asks both queries of every kernel, asserts that all give the same bits, and returns the answers.
pub fn ask(accel: &mut Accel, questions: &[(Ray, PrimRange)]) -> Vec<Answer> {
    let mut first: Option<(SimdKernel, Vec<Answer>)> = None;
    for kernel in kernels() {
        assert!(accel.set_kernel(kernel) && accel.kernel() == kernel);
        let answer = |(ray, skip): &(Ray, PrimRange)| (accel.closest(ray), accel.occluded(ray, *skip));
        let answers: Vec<Answer> = questions.iter().map(answer).collect();
        let Some((reference, expected)) = &first else {
            first = Some((kernel, answers));
            continue;
        };
        for ((question, a), b) in questions.iter().zip(&answers).zip(expected) {
            let same = (bits(a.0), a.1) == (bits(b.0), b.1);
            assert!(same, "{}: {a:?}\n{}: {b:?}\n{question:?}", kernel.name(), reference.name());
        }
    }
    first.expect("the scalar kernel runs everywhere").1
}

/// Asks both queries of every kernel, with nothing skipped.
pub fn ask_one(accel: &mut Accel, ray: Ray) -> Answer {
    ask(accel, &[(ray, PrimRange::NONE)])[0]
}

/// The primitives of an accelerator.
#[derive(Clone, Debug, Default)]
pub struct Primitives {
    pub triangles: Vec<[Vec3; 3]>,
    /// First halves of parallelograms, ascending.
    pub quads: Vec<u32>,
    pub disks: Vec<Disk>,
    pub spheres: Vec<Sphere>,
    pub cylinders: Vec<Cylinder>,
}

impl Primitives {
    pub fn of(triangles: &[[Vec3; 3]]) -> Self {
        Self { triangles: triangles.to_vec(), ..Self::default() }
    }

    /// Adds a triangle when it has an area, as [`Accel::new`] asks for.
    pub fn triangle(&mut self, t: [Vec3; 3]) {
        if Triangle::new(t).is_some() {
            self.triangles.push(t);
        }
    }

    /// Adds the parallelogram from `a` with the sides `x` and `y`.
    pub fn quad(&mut self, a: Vec3, x: Vec3, y: Vec3) {
        let halves = [[a, a + x, a + x + y], [a, a + x + y, a + y]];
        if halves.iter().all(|&t| Triangle::new(t).is_some()) {
            self.quads.push(self.triangles.len() as u32);
            self.triangles.extend(halves);
        }
    }

    pub fn accel(&self) -> Accel {
        let (disks, spheres, cylinders) = (self.disks.clone(), self.spheres.clone(), self.cylinders.clone());
        let shapes = Shapes {
            triangles: &self.triangles,
            quads: &self.quads,
            disks,
            spheres,
            cylinders,
            ..Shapes::default()
        };
        Accel::new(shapes, &[], &[])
    }

    /// Every triangle and parallelogram as its corners in order, with its id.
    pub fn polygons(&self) -> Vec<(u32, Vec<Vec3>)> {
        let mut found = Vec::new();
        let mut id = 0;
        while id < self.triangles.len() {
            let mut corners = self.triangles[id].to_vec();
            let first = id as u32;
            if self.quads.binary_search(&first).is_ok() {
                corners.push(self.triangles[id + 1][2]);
                id += 1;
            }
            found.push((first, corners));
            id += 1;
        }
        found
    }

    /// Every primitive in an accelerator of its own.
    pub fn singles(&self) -> Singles {
        let mut all = Vec::new();
        for (id, corners) in self.polygons() {
            let two =
                [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[corners.len() - 1]]];
            let (count, quads) = if corners.len() == 4 { (2, &[0][..]) } else { (1, &[][..]) };
            let shapes = Shapes { triangles: &two[..count].to_vec(), quads, ..Shapes::default() };
            all.push((id, Accel::new(shapes, &[], &[])));
        }
        let first = self.triangles.len() as u32;
        let alone = |shapes| Accel::new(shapes, &[], &[]);
        let disks = self.disks.iter().map(|&d| alone(Shapes { disks: vec![d], ..Shapes::default() }));
        let spheres = self.spheres.iter().map(|&s| alone(Shapes { spheres: vec![s], ..Shapes::default() }));
        let tube = |&c: &Cylinder| alone(Shapes { cylinders: vec![c], ..Shapes::default() });
        all.extend((first..).zip(disks.chain(spheres).chain(self.cylinders.iter().map(tube))));
        Singles(all)
    }
}

/// Brute force: primitives that are asked one by one.
pub struct Singles(Vec<(u32, Accel)>);

impl Singles {
    /// Every hit with `t < t_max`, nearest first, the lowest id first among equals. Each is asked without an end: whether
    /// and where a primitive is hit must not depend on where the ray ends.
    pub fn hits(&self, ray: &Ray) -> Vec<Hit> {
        let endless = Ray { t_max: f32::INFINITY, ..*ray };
        let mut hits: Vec<Hit> = self
            .0
            .iter()
            .filter_map(|(id, accel)| accel.closest(&endless).map(|h| Hit { prim: *id, ..h }))
            .filter(|h| h.t < ray.t_max)
            .collect();
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim)));
        hits
    }
}

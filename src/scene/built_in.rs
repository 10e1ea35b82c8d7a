//! The scenes that the binary carries.

/// A scene of the binary.
pub struct BuiltIn {
    /// Name on the command line.
    pub name: &'static str,
    /// What it is good for.
    pub purpose: &'static str,
    /// Its text.
    pub text: &'static str,
    /// Files that the text names.
    pub files: &'static [(&'static str, &'static str)],
    /// Image by an independent renderer (EXR) and the mask of the pixels that count (PNG).
    pub reference: Option<(&'static [u8], &'static [u8])>,
}

macro_rules! reference {
    ($name:literal) => {
        Some((
            include_bytes!(concat!("../../assets/references/", $name, ".exr")).as_slice(),
            include_bytes!(concat!("../../assets/references/", $name, "_mask.png")).as_slice(),
        ))
    };
}

/// All built-in scenes, the default first.
pub const BUILT_IN: &[BuiltIn] = &[
    BuiltIn {
        name: "ring",
        purpose: "caustic of a metal ring: the thesis's test case",
        text: include_str!("../../assets/scenes/ring.toml"),
        files: &[],
        reference: reference!("ring"),
    },
    BuiltIn {
        name: "ring_soft",
        purpose: "the ring under a sphere light: mirror chains, soft shadow",
        text: include_str!("../../assets/scenes/ring_soft.toml"),
        files: &[],
        reference: reference!("ring_soft"),
    },
    BuiltIn {
        name: "cornell",
        purpose: "Cornell box: diffuse interreflection",
        text: include_str!("../../assets/scenes/cornell.toml"),
        files: &[],
        reference: reference!("cornell"),
    },
    BuiltIn {
        name: "glass_ball",
        purpose: "a glass ball on a floor, with an independent reference",
        text: include_str!("../../assets/scenes/glass_ball.toml"),
        files: &[],
        reference: reference!("glass_ball"),
    },
    BuiltIn {
        name: "glass_sphere",
        purpose: "a tinted glass sphere between coloured walls: caustic and interreflection",
        text: include_str!("../../assets/scenes/glass_sphere.toml"),
        files: &[],
        reference: None,
    },
    BuiltIn {
        name: "plane",
        purpose: "a point light over a plane: E = Φ cos θ/(4π r²)",
        text: include_str!("../../assets/scenes/plane.toml"),
        files: &[],
        reference: None,
    },
    BuiltIn {
        name: "two_lights",
        purpose: "a room lit mostly indirectly by two hidden lights: for final gathering",
        text: include_str!("../../assets/scenes/two_lights.toml"),
        files: &[],
        reference: None,
    },
    BuiltIn {
        name: "prism_wall",
        purpose: "a glass prism throws a bright band on a wall: caustic of refraction",
        text: include_str!("../../assets/scenes/prism_wall.toml"),
        files: &[("prism.obj", include_str!("../../assets/scenes/prism.obj"))],
        reference: None,
    },
    BuiltIn {
        name: "rooms",
        purpose: "five rooms with a moving light and a moving box: for real-time photon mapping",
        text: include_str!("../../assets/scenes/rooms.toml"),
        files: &[
            ("rooms.obj", include_str!("../../assets/scenes/rooms.obj")),
            ("rooms.mtl", include_str!("../../assets/scenes/rooms.mtl")),
        ],
        reference: None,
    },
];

/// The built-in scene of that name.
pub fn find(name: &str) -> Option<&'static BuiltIn> {
    BUILT_IN.iter().find(|b| b.name == name)
}

/// Names of all built-in scenes, separated by commas.
pub fn names() -> String {
    BUILT_IN.iter().map(|b| b.name).collect::<Vec<_>>().join(", ")
}

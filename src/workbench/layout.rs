//! How the parts of the window are docked.

use egui_tiles::{Container, Linear, LinearDir, Tile, TileId, Tiles, Tree};
use serde::{Deserialize, Serialize};

/// A part of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pane {
    /// The image panel of that number.
    Image(usize),
    /// Scene, materials and lights.
    Scene,
    /// Camera.
    Camera,
    /// Photons and gathering.
    Photons,
    /// Estimators of the panels.
    Estimators,
    /// Exposure, false colour, comparison.
    Display,
    /// Overlays.
    Overlays,
    /// The plan.
    Plan,
    /// The pinned pixel.
    Inspector,
    /// Error against run time.
    ErrorPlot,
    /// Time by phase.
    TimePlot,
    /// Footprint areas.
    AreaPlot,
    /// Messages.
    Messages,
}

impl Pane {
    /// Title of its tab.
    pub fn title(self) -> &'static str {
        match self {
            Self::Image(_) => "Image",
            Self::Scene => "Scene",
            Self::Camera => "Camera",
            Self::Photons => "Photons",
            Self::Estimators => "Estimators",
            Self::Display => "Display",
            Self::Overlays => "Overlays",
            Self::Plan => "Plan",
            Self::Inspector => "Inspector",
            Self::ErrorPlot => "Error against time",
            Self::TimePlot => "Time by phase",
            Self::AreaPlot => "Footprint areas",
            Self::Messages => "Messages",
        }
    }
}

/// The layout of a first start, with `images` image panels.
pub fn standard(images: usize) -> Tree<Pane> {
    let mut tiles = Tiles::default();
    let mut tabs = |panes: &[Pane]| {
        let children = panes.iter().map(|p| tiles.insert_pane(*p)).collect();
        tiles.insert_tab_tile(children)
    };
    let upper = tabs(&[Pane::Photons, Pane::Estimators, Pane::Scene, Pane::Camera]);
    let lower = tabs(&[Pane::Display, Pane::Overlays, Pane::Plan]);
    let right = tabs(&[Pane::Inspector]);
    let plots = [Pane::ErrorPlot, Pane::TimePlot, Pane::AreaPlot, Pane::Messages].map(|p| tabs(&[p]));
    let children = (0..images).map(|i| tiles.insert_pane(Pane::Image(i))).collect();
    let grid = tiles.insert_grid_tile(children);
    let left = linear(&mut tiles, LinearDir::Vertical, &[(upper, 0.55), (lower, 0.45)]);
    let middle = linear(&mut tiles, LinearDir::Horizontal, &[(left, 0.19), (grid, 0.59), (right, 0.22)]);
    let bottom = linear(&mut tiles, LinearDir::Horizontal, &plots.map(|p| (p, 0.25)));
    let root = linear(&mut tiles, LinearDir::Vertical, &[(middle, 0.78), (bottom, 0.22)]);
    Tree::new(egui::Id::unique("parts"), root, tiles)
}

fn linear(tiles: &mut Tiles<Pane>, dir: LinearDir, children: &[(TileId, f32)]) -> TileId {
    let mut container = Linear::new(dir, children.iter().map(|c| c.0).collect());
    for (child, share) in children {
        container.shares.set_share(*child, *share);
    }
    tiles.insert_new(Tile::Container(Container::Linear(container)))
}

/// Gives the tree exactly the image panels 0 to `images`, wherever those that it has are docked.
pub fn fit(tree: &mut Tree<Pane>, images: usize) {
    let mut seen = vec![false; images];
    let mut extra = Vec::new();
    for (id, tile) in tree.tiles.iter() {
        if let Tile::Pane(Pane::Image(i)) = tile {
            match seen.get_mut(*i) {
                Some(seen) if !*seen => *seen = true,
                _ => extra.push(*id),
            }
        }
    }
    for id in extra {
        tree.remove_recursively(id);
    }
    for (i, _) in seen.iter().enumerate().filter(|(_, seen)| !**seen) {
        let pane = tree.tiles.insert_pane(Pane::Image(i));
        match home(tree).or(tree.root()) {
            Some(home) => tree.move_tile_to_container(pane, home, usize::MAX, false),
            None => *tree = standard(images),
        }
    }
}

/// The container that holds an image panel, or else the largest grid.
fn home(tree: &Tree<Pane>) -> Option<TileId> {
    let containers = || tree.tiles.iter().filter(|(_, t)| matches!(t, Tile::Container(_)));
    let holds_image = |tile: &Tile<Pane>| match tile {
        Tile::Container(c) => c.children().any(|c| matches!(tree.tiles.get(*c), Some(Tile::Pane(Pane::Image(_))))),
        Tile::Pane(_) => false,
    };
    let is_grid = |tile: &Tile<Pane>| matches!(tile, Tile::Container(Container::Grid(_)));
    let with =
        |f: &dyn Fn(&Tile<Pane>) -> bool| containers().filter(|(_, t)| f(t)).map(|(id, _)| *id).min_by_key(|id| id.0);
    with(&|t| is_grid(t) && holds_image(t)).or_else(|| with(&holds_image)).or_else(|| with(&is_grid))
}

/// Removes the image panel `index` and closes the gap in the numbers of the others.
pub fn remove_image(tree: &mut Tree<Pane>, index: usize) {
    let found = tree.tiles.find_pane(&Pane::Image(index));
    if let Some(id) = found {
        tree.remove_recursively(id);
    }
    for (_, tile) in tree.tiles.iter_mut() {
        if let Tile::Pane(Pane::Image(i)) = tile
            && *i > index
        {
            *i -= 1;
        }
    }
}

/// Brings a pane to the front, and back into the window if it was closed.
pub fn show(tree: &mut Tree<Pane>, pane: Pane) {
    match tree.tiles.find_pane(&pane) {
        Some(id) => {
            tree.set_visible(id, true);
            tree.make_active(|_, tile| matches!(tile, Tile::Pane(p) if *p == pane));
        }
        None => {
            let id = tree.tiles.insert_pane(pane);
            if let Some(root) = tree.root() {
                tree.move_tile_to_container(id, root, usize::MAX, false);
            }
        }
    }
}

/// The layout as text for a session, the same for the same layout.
pub fn to_text(tree: &Tree<Pane>) -> Option<String> {
    // The tree holds its tiles in no order; a JSON value sorts its keys.
    serde_json::to_value(tree).ok().map(|value| value.to_string())
}

/// A layout from a session's text; None if it is of another version.
pub fn from_text(text: &str) -> Option<Tree<Pane>> {
    serde_json::from_str(text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(tree: &Tree<Pane>) -> Vec<usize> {
        let mut all: Vec<usize> = tree
            .tiles
            .tiles()
            .filter_map(|t| match t {
                Tile::Pane(Pane::Image(i)) => Some(*i),
                _ => None,
            })
            .collect();
        all.sort_unstable();
        all
    }

    #[test]
    fn image_panels_come_and_go() {
        let mut tree = standard(4);
        assert_eq!(images(&tree), [0, 1, 2, 3]);
        remove_image(&mut tree, 1);
        assert_eq!(images(&tree), [0, 1, 2]);
        fit(&mut tree, 5);
        assert_eq!(images(&tree), [0, 1, 2, 3, 4]);
        fit(&mut tree, 0);
        assert!(images(&tree).is_empty());
        fit(&mut tree, 2);
        assert_eq!(images(&tree), [0, 1]);
    }

    #[test]
    fn layouts_come_back_as_they_were_written() {
        let tree = standard(3);
        let again = from_text(&to_text(&tree).expect("a text")).expect("a tree");
        assert_eq!(images(&again), [0, 1, 2]);
        assert_eq!(to_text(&again), to_text(&tree));
        assert!(from_text("{}").is_none());
    }
}

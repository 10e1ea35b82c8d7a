//! Tables and figures of the paper on final gathering (Gjøl, Larsen and Christensen, *Final Gathering using Ray
//! Differentials*).

mod chart;
mod drawing;
pub mod figure_1;
pub mod figure_2;
pub mod figure_3;
pub mod figures_4_5;
mod layers;
mod measured;
mod methods;
mod output;
mod printed;
mod reference;
mod room;
mod rows;
pub mod table;
mod table_top;

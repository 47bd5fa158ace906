//! A front end fitted to a measured cube: what the samples say of it ([`estimate`]), and a simulated cube of the fitted front end
//! beside the measured one ([`compare`]).

pub mod channels;
pub mod compare;
pub mod estimate;

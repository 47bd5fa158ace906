//! The classes that a network tells apart.

use catseye::base::error::{BadInput, Result, nearest};
use catseye::road::mask::CellClass;

/// The name that points have which are of no other class.
pub const OTHERS: &str = "others";

/// The classes that a network tells apart, in the order of its outputs. The first is "undefined", to which all others belong; of points
/// it is called "others".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Classes(Vec<(CellClass, &'static str)>);

impl Classes {
    /// Classes of cells by their names in files.
    ///
    /// # Errors
    /// Returns `BadInput` if a name is unknown or given twice, if fewer than two are given or if the first is not "undefined".
    pub fn named(names: &[String]) -> Result<Classes> {
        Classes::of(names, &CellClass::ALL.map(|c| (c, c.name())))
    }

    /// Classes of points by their names in files: "others", and those of cells but "undefined" and "lane". No point is of a lane, which no radar
    /// sees.
    ///
    /// # Errors
    /// Returns the errors of [`Classes::named`], with "others" in place of "undefined".
    pub fn of_points(names: &[String]) -> Result<Classes> {
        let objects =
            CellClass::ALL.into_iter().filter(|c| ![CellClass::Undefined, CellClass::Lane].contains(c));
        let objects: Vec<(CellClass, &str)> = objects.map(|c| (c, c.name())).collect();
        Classes::of(names, &[&[(CellClass::Undefined, OTHERS)][..], &objects].concat())
    }

    /// Classes of objects with contours: those of cells without "marker", which is smaller than a cell.
    ///
    /// # Errors
    /// Returns the errors of [`Classes::named`].
    pub fn of_objects(names: &[String]) -> Result<Classes> {
        let all: Vec<(CellClass, &str)> = CellClass::ALL.map(|c| (c, c.name())).to_vec();
        let wide: Vec<(CellClass, &str)> = all.into_iter().filter(|c| c.0 != CellClass::Marker).collect();
        Classes::of(names, &wide)
    }

    /// Classes of a list of known ones, whose first is the one to which all others belong.
    fn of(names: &[String], all: &[(CellClass, &'static str)]) -> Result<Classes> {
        let known: Vec<&str> = all.iter().map(|c| c.1).collect();
        let bad = |problem: &str| BadInput::new(problem).allowed(known.join(", "));
        let mut classes = Vec::new();
        for name in names {
            let Some(class) = all.iter().find(|c| c.1 == name) else {
                let near = nearest(name, known.iter().copied());
                let remedy = near.map_or("remove the name".into(), |n| format!("did you mean '{n}'?"));
                return Err(bad("is not a class").value(format!("\"{name}\"")).remedy(remedy).into());
            };
            if classes.contains(class) {
                let twice = bad("the class is listed twice").value(format!("\"{name}\""));
                return Err(twice.remedy("remove one of them").into());
            }
            classes.push(*class);
        }
        if classes.len() < 2 || classes.first() != all.first() {
            let remedy = format!("begin with \"{}\" and add at least one class", known[0]);
            return Err(bad("the list must contain the background and at least one other class")
                .remedy(remedy)
                .into());
        }
        Ok(Classes(classes))
    }

    /// Number of classes.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The class at a place.
    pub fn class(&self, place: usize) -> CellClass {
        self.0[place].0
    }

    /// Names in order.
    pub fn names(&self) -> Vec<String> {
        self.0.iter().map(|c| c.1.to_string()).collect()
    }

    /// The place of a class in the list; 0 where it is not in it.
    pub fn place(&self, class: CellClass) -> u8 {
        self.0.iter().position(|c| c.0 == class).unwrap_or(0) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn classes(names: &[&str]) -> Result<Classes> {
        Classes::named(&names.iter().map(|n| n.to_string()).collect::<Vec<_>>())
    }

    #[test]
    fn wrong_classes_are_refused() {
        for (names, words) in [
            (&["undefined", "lanes"][..], "\"lanes\": is not a class"),
            (&["lane", "undefined"], "begin with \"undefined\""),
            (&["undefined"], "add at least one class"),
            (&["undefined", "lane", "lane"], "listed twice"),
        ] {
            let text = classes(names).unwrap_err().to_string();
            assert!(text.contains(words) && text.contains("guard rail"), "{text}");
        }
        assert!(classes(&["undefined", "lanes"]).unwrap_err().to_string().contains("did you mean 'lane'?"));
        let points =
            |names: &[&str]| Classes::of_points(&names.iter().map(|n| n.to_string()).collect::<Vec<_>>());
        assert_eq!(points(&["others", "marker"]).unwrap().class(1), CellClass::Marker);
        let lane = points(&["others", "lane"]).unwrap_err().to_string();
        assert!(
            lane.contains("\"lane\": is not a class; allowed: others, vehicle, guard rail, marker"),
            "{lane}"
        );
        assert!(points(&["vehicle", "others"]).unwrap_err().to_string().contains("begin with \"others\""));
    }
}

//! What the classes of objects are to other tools.

/// A kind of road user. Everything else stands beside the road or is part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RoadUser {
    /// A passenger car.
    Car,
    /// A van.
    Van,
    /// A truck.
    Truck,
    /// A bus or coach.
    Bus,
    /// A train or tram.
    Train,
    /// A motorcycle.
    Motorcycle,
    /// A cyclist with the bicycle.
    Cyclist,
    /// A pedestrian.
    Pedestrian,
    /// An animal.
    Animal,
}

/// The road user of a class, its parts too (`car.wheel`); `None` for what is none.
pub fn road_user(class: &str) -> Option<RoadUser> {
    let whole = class.split_once('.').map_or(class, |(whole, _)| whole);
    Some(match whole {
        "car" => RoadUser::Car,
        "van" => RoadUser::Van,
        "truck" | "trailer" => RoadUser::Truck,
        "bus" => RoadUser::Bus,
        "train" | "tram" => RoadUser::Train,
        "motorcycle" => RoadUser::Motorcycle,
        "cyclist" | "bicycle" => RoadUser::Cyclist,
        "pedestrian" => RoadUser::Pedestrian,
        "animal" => RoadUser::Animal,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_of_their_whole() {
        assert_eq!(road_user("car.wheel"), Some(RoadUser::Car));
        assert_eq!(road_user("bicycle"), Some(RoadUser::Cyclist));
        assert_eq!((road_user("guard_rail"), road_user("")), (None, None));
    }
}

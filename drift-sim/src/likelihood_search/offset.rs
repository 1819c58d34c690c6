//! The plant's offset that takes in a load that stays. Physics may depend on the offset itself (what radiates to the surroundings does), so that it is not the load that
//! it moves by: what drives the plant at any y has to stay as it was.

use crate::control_loop::Loop;
use crate::estimate::linear_part::effect;
use crate::physics::{Hook, Motion};
use crate::plant::{Plant, Role};

/// Steps of Newton's method. A fourth power near 300 K is all but straight.
const STEPS: usize = 20;
/// Step of a slope, in the unit of y.
const SLOPE_STEP: f64 = 1e-3;

/// The plant's offset under which nothing else drives it than under the stated one and this load; `None` where it has none.
pub fn under(model: &Loop, constant_load: f64) -> Option<f64> {
    let stated = of(&model.plant)?;
    let driven_at = |offset: f64| driven(model, offset);
    let wanted = driven_at(stated) - constant_load;
    let mut offset = stated - constant_load;
    for _ in 0..STEPS {
        let driven = driven_at(offset);
        let (off, slope) = (driven - wanted, (driven_at(offset + SLOPE_STEP) - driven) / SLOPE_STEP);
        if off == 0.0 || !(slope.is_finite() && slope > 0.0) {
            break;
        }
        offset -= off / slope;
    }
    offset.is_finite().then_some(offset)
}

/// The plant with another offset; as it is where it has none.
pub fn with(plant: &Plant, offset: f64) -> Plant {
    let numbers = plant.numbers();
    let values = numbers.iter().map(|n| if n.role == Role::Offset { offset } else { n.value });
    plant.with_numbers(&values.collect::<Vec<_>>())
}

/// The plant's offset; `None` where it has none.
pub fn of(plant: &Plant) -> Option<f64> {
    plant.numbers().iter().find(|number| number.role == Role::Offset).map(|number| number.value)
}

/// What drives the plant at rest at y = 0, as far as it depends on the offset.
fn driven(model: &Loop, offset: f64) -> f64 {
    let model = Loop { plant: with(&model.plant, offset), ..model.clone() };
    let at_rest = Motion { position: 0.0, velocity: 0.0 };
    let effects = model.physics.iter().map(|term| effect(&model, term));
    let forces = effects.filter(|effect| effect.hooks().contains(&Hook::Force));
    offset + forces.map(|effect| effect.force(at_rest)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use crate::control_loop::Loop;

    const OVEN: &str = "[loop]\nsample_time_s = 5.0\n[controller]\nkind = \"recorded\"\n[plant]\nkind = \"first-order\"\ngain = 0.5\n\
                        time_constant_s = 100.0\noffset = 26.0\n";

    /// An oven at 60 degC that radiates: where it comes to rest under a load is where it rests under the offset that takes the load in, by the balance written out.
    #[test]
    fn what_radiates_rests_where_it_rested_under_the_load() {
        let radiation = "[[physics]]\nkind = \"radiation\"\ncoefficient = 3e-9\n";
        let oven = Loop::parse(&format!("{OVEN}{radiation}"), "an oven").unwrap();
        let kelvin = |celsius: f64| (celsius + 273.15).powi(4);
        let balance = |offset: f64, load: f64| {
            0.5 * 80.0 + offset - load - 60.0 - 3e-9 * (kelvin(60.0) - kelvin(offset))
        };
        for load in [3.4, -7.0, 0.0] {
            let offset = super::under(&oven, load).unwrap();
            assert!((balance(offset, 0.0) - balance(26.0, load)).abs() < 1e-9, "{load}: {offset}");
        }
    }

    /// Without physics that depends on it, the offset moves by the load.
    #[test]
    fn a_plain_plant_s_offset_takes_the_load_in_as_it_is() {
        let oven = Loop::parse(OVEN, "an oven").unwrap();
        assert!((super::under(&oven, 3.4).unwrap() - 22.6).abs() < 1e-12);
    }
}

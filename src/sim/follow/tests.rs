use super::*;
use crate::base::boundary::BoundaryPoint;
use crate::base::{Surface, SurfacePoint};
use crate::sim::drop::{DropStart, HeldRim, HeldSurface};

/// On a 31 x 31 grid: rests within a second.
fn options() -> SimOptions {
    SimOptions { vertices: 31, fall_vertices: 21, ..SimOptions::default() }
}

fn stiff_knit() -> Fabric {
    Fabric::from_paper_units([240e3, 310e3, 90e3, 5200.0, 3600.0, 4100.0, 260.0])
}

fn scaled(fabric: &Fabric, factors: [f64; 7]) -> Fabric {
    let values = fabric.in_si();
    Fabric::from_si(std::array::from_fn(|k| values[k] * factors[k]))
}

fn dropped() -> Follower {
    Follower::drop(&stiff_knit(), &Drop { start: DropStart::Perturbed(3) }, &options())
}

/// What [`dropped`] gives, simulated once.
fn drape_dropped() -> &'static Drape {
    static DRAPE: std::sync::OnceLock<Drape> = std::sync::OnceLock::new();
    DRAPE.get_or_init(|| dropped().drape())
}

#[test]
fn a_drape_followed_to_itself_stays_where_it_is() {
    let mut follower = dropped();
    let before = follower.drape();
    assert_eq!(before.stop, Stop::AtRest);
    let followed = follower.follow_fabric(&stiff_knit(), &FollowOptions::default()).unwrap();
    assert_eq!(followed.stop, Stop::AtRest);
    assert_eq!(followed.reached, 1.0);
    assert!(followed.events.is_empty());
    let moved_m = before.boundary.mean_distance_m(&follower.boundary());
    // observed 1e-9 m; a model that forgets the grips moves by 0.04 to 2 mm
    assert!(moved_m < 2e-5, "{moved_m}");
}

#[test]
fn a_way_there_and_back_without_an_event_ends_where_it_began_and_costs_little() {
    let woven = Fabric::from_paper_units([131e3, 164e3, 75e3, 11_200.0, 11_200.0, 11_200.0, 180.0]);
    let to = scaled(&woven, [1.1, 0.95, 1.05, 0.92, 1.07, 1.0, 1.03]);
    let how = FollowOptions::default();
    let mut quiet = 0;
    for seed in 1..=4 {
        let drop = Drop { start: DropStart::Perturbed(seed) };
        let mut follower = Follower::drop(&woven, &drop, &options());
        let start = follower.drape();
        let there = follower.follow_fabric(&to, &how).unwrap();
        let away_m = start.boundary.mean_distance_m(&follower.boundary());
        let back = follower.follow_fabric(&woven, &how).unwrap();
        assert_eq!([there.stop, back.stop], [Stop::AtRest; 2]);
        assert_eq!(follower.drape().intersections, 0);
        assert!(away_m > 0.3e-3, "the way leads somewhere: {away_m}");
        if there.events.is_empty() && back.events.is_empty() {
            quiet += 1;
            let off_m = start.boundary.mean_distance_m(&follower.boundary());
            assert!(off_m < 0.3e-3, "seed {seed}: {off_m}");
            let spent = there.effort.factorisations + back.effort.factorisations;
            assert!(4 * spent < start.effort.factorisations, "seed {seed}: {spent}");
        }
    }
    assert!(quiet >= 2, "{quiet} of 4 ways are without an event");
}

#[test]
fn stiffness_and_weight_together_change_nothing() {
    let mut follower = dropped();
    let start = follower.boundary();
    let to = scaled(&stiff_knit(), [1.5; 7]);
    let followed = follower.follow_fabric(&to, &FollowOptions::default()).unwrap();
    assert_eq!(followed.stop, Stop::AtRest);
    assert_eq!(follower.setup().fabric, to);
    assert!(followed.events.is_empty());
    let moved_m = start.mean_distance_m(&follower.boundary());
    println!("{moved_m:.1e} m");
    // grips that keep the old weight's friction let a sheet go that hardly holds: 4.3 mm
    assert!(moved_m < 1e-6, "{moved_m:e}");
}

#[test]
fn a_plate_that_tilts_is_followed_too() {
    let mut follower = dropped();
    let start = follower.drape();
    let mut to = *follower.setup();
    to.experiment.tilt.down_x_rad = 0.01;
    to.experiment.plate.radius_m = 0.0502;
    let followed = follower.follow(&to, &FollowOptions::default()).unwrap();
    assert_eq!(followed.stop, Stop::AtRest);
    let end = follower.drape();
    assert_eq!(end.intersections, 0);
    let moved_m = start.boundary.mean_distance_m(&end.boundary);
    assert!((0.05e-3..8e-3).contains(&moved_m), "{moved_m}");
}

#[test]
fn a_branch_that_ends_is_told_and_where_it_was_to_stop_the_way_stops() {
    // from stiff to thirty times softer: the few folds of a stiff sheet do not last
    let mut follower = dropped();
    let to = scaled(&stiff_knit(), [1.0, 1.0, 1.0, 0.03, 0.03, 0.03, 1.0]);
    let how = FollowOptions { on_event: OnEvent::Stop, ..FollowOptions::default() };
    let followed = follower.follow_fabric(&to, &how).unwrap();
    let [event] = &followed.events[..] else { panic!("{} events", followed.events.len()) };
    assert!(followed.reached < 1.0);
    assert_eq!(event.stretch[1], followed.reached);
    assert_eq!(event.after, follower.boundary());
    assert!(event.before.mean_distance_m(&event.after) > 0.3e-3);
    assert!(event.branch_jump_m > how.branch_jump_m);
}

#[test]
fn only_a_sheet_at_rest_is_followed_and_never_to_another_outline() {
    let mut restless = Follower::drop(
        &stiff_knit(),
        &Drop::canonical(),
        &SimOptions { iterations: 0, ..options() },
    );
    let how = FollowOptions::default();
    let refused = restless.follow_fabric(&stiff_knit(), &how).unwrap_err();
    assert!(matches!(refused, FollowError::NotAtRest(_)), "{refused}");
    let mut follower = dropped();
    let mut to = *follower.setup();
    to.experiment.specimen.outline = crate::sim::experiment::Outline::Disc;
    assert_eq!(follower.follow(&to, &how).unwrap_err(), FollowError::OtherOutline);
}

#[test]
fn a_sheet_that_was_to_end_early_is_led_by_descents_to_nearly_the_same_rest() {
    let early = SimOptions { energy_drop: 1e-5, ..options() };
    let soft = scaled(&stiff_knit(), [0.3, 0.3, 0.3, 0.1, 0.1, 0.1, 1.0]);
    let mut follower = Follower::drop(&soft, &Drop::canonical(), &early);
    assert_eq!(follower.drape().stop, Stop::Slow);
    let to = scaled(&soft, [1.0, 1.0, 1.0, 1.2, 1.2, 1.2, 1.0]);
    let before = follower.boundary();
    let followed = follower.follow_fabric(&to, &FollowOptions::default()).unwrap();
    assert!(followed.stop.is_as_asked() && followed.reached == 1.0);
    assert_eq!(followed.descents, followed.steps);
    assert_eq!(*follower.setup(), Setup { fabric: to, ..*follower.setup() });
    // the same sheet with nothing left to gain
    let led = follower.boundary();
    follower.options.energy_drop = 0.0;
    assert_eq!(follower.release(), Stop::AtRest);
    let (moved_m, short_m) =
        (before.mean_distance_m(&led), led.mean_distance_m(&follower.boundary()));
    println!("{:.2} mm led, {:.2} mm short of rest", moved_m * 1e3, short_m * 1e3);
    // observed: 0.52 and 0.01 mm
    assert!(moved_m > 0.3e-3 && short_m < 0.2 * moved_m, "{moved_m} {short_m}");
}

/// The sheet of a drape as a surface, with the error that it is said to have.
fn surface_of(drape: &Drape, sigma_m: f64) -> Surface {
    let even = drape.grid.evenly(Surface::SIDE);
    let point = |p: Vector3| SurfacePoint { position_m: p.into(), sigma_m, observed: true };
    let places = even.prolong(&drape.grid, &drape.positions_m, 1.0);
    Surface::new(places.into_iter().map(point).collect()).unwrap()
}

/// A sheet of `fabric` held to that of the dropped stiff knit.
fn held(fabric: &Fabric, sag_m: f64) -> Follower {
    let surface = surface_of(drape_dropped(), 0.1e-3);
    let start = DropStart::HeldSurface(Box::new(HeldSurface { surface, sag_m, farther: 0.0 }));
    Follower::drop(fabric, &Drop { start }, &options())
}

#[test]
fn a_held_sheet_stays_the_nearer_to_its_surface_the_stronger_the_springs_until_it_is_released() {
    let rim = drape_dropped().boundary.clone();
    let softer = scaled(&stiff_knit(), [1.0, 1.0, 1.0, 0.6, 0.6, 0.6, 1.0]);
    let far = [100e-3, 30e-3, 10e-3].map(|sag_m| {
        let mut follower = held(&softer, sag_m);
        assert_eq!(follower.drape().stop, Stop::AtRest);
        let held_m = rim.mean_distance_m(&follower.boundary());
        assert_eq!(follower.release(), Stop::AtRest);
        let free_m = rim.mean_distance_m(&follower.boundary());
        println!("{:.0} mm: {:.2} mm, released {:.2} mm", sag_m * 1e3, held_m * 1e3, free_m * 1e3);
        // observed: 2.3, 1.3 and 0.6 mm, released 4.4
        assert!(held_m < 0.7 * free_m, "{held_m} {free_m}");
        held_m
    });
    assert!(far[0] > far[1] && far[1] > far[2], "{far:?}");
    // the fabric's own sheet is hardly held at all
    let own_m = rim.mean_distance_m(&held(&stiff_knit(), 30e-3).boundary());
    assert!(own_m < 0.2 * far[1], "{own_m}");
}

#[test]
fn a_sheet_held_to_a_surface_of_another_scale_is_drawn_towards_it() {
    let rim = drape_dropped().boundary.clone();
    let mut follower = held(&stiff_knit(), 10e-3);
    let before = follower.boundary();
    let drawn = |follower: &mut Follower, by: f64| {
        follower.hold_farther(by);
        let here = *follower.setup();
        let way = follower.follow(&here, &FollowOptions::default()).unwrap();
        assert_eq!(way.stop, Stop::AtRest);
        let both = follower.boundary();
        let both = both.positions_m().zip(rim.positions_m());
        both.map(|(p, own)| (p - own).dot(&own.coords.normalize())).sum::<f64>() / 244.0
    };
    let [larger, smaller, back] = [0.02, -0.02, 0.0].map(|by| drawn(&mut follower, by));
    println!("{:.3} mm, {:.3} mm, back {:.3} mm", larger * 1e3, smaller * 1e3, back * 1e3);
    assert!(larger - back > 0.1e-3 && back - smaller > 0.1e-3, "{larger} {smaller} {back}");
    assert!(before.mean_distance_m(&follower.boundary()) < 0.1 * (larger - smaller));
}

#[test]
fn a_held_sheet_follows_its_fabric_as_its_sensitivities_predict_and_the_springs_its_weight() {
    let mut follower = held(&stiff_knit(), 30e-3);
    let before = follower.drape();
    let [bending] = follower.sensitivities(&[Parameter::BendingWeft]).unwrap().try_into().unwrap();
    let to = scaled(&stiff_knit(), [1.0, 1.0, 1.0, 1.03, 1.0, 1.0, 1.0]);
    let change = to.bending_weft_nm - stiff_knit().bending_weft_nm;
    let way = follower.follow_fabric(&to, &FollowOptions::default()).unwrap();
    assert_eq!((way.stop, way.events.len()), (Stop::AtRest, 0));
    let after = follower.drape();
    let moves = after.positions_m.iter().zip(&before.positions_m).map(|(a, b)| a - b);
    let off = moves.clone().zip(&bending.moves).map(|(went, predicted)| went - predicted * change);
    let [off_m, went_m] = [off.collect::<Vec<_>>(), moves.collect()]
        .map(|all: Vec<Vector3>| root_mean_square(all.into_iter()));
    println!("went {went_m:.2e} m, {off_m:.2e} m off");
    assert!(went_m > 1e-5 && off_m < 0.05 * went_m, "{went_m} {off_m}");
    // everything times one factor, springs and all
    let heavy = scaled(&to, [1.5; 7]);
    let way = follower.follow_fabric(&heavy, &FollowOptions::default()).unwrap();
    assert_eq!(way.stop, Stop::AtRest);
    assert!(after.boundary.mean_distance_m(&follower.boundary()) < 1e-6);
}

#[test]
fn a_sheet_led_by_its_rim_stays_while_that_is_held_but_for_what_is_not_known() {
    let woven = Fabric::from_paper_units([131e3, 164e3, 75e3, 11_200.0, 9_200.0, 10_200.0, 180.0]);
    let truth = Follower::drop(&woven, &Drop { start: DropStart::Perturbed(1) }, &options());
    let rim = truth.boundary();
    let held = |rim: &Boundary| {
        let start =
            DropStart::HeldRim(Box::new(HeldRim { rim: rim.clone(), sag_m: 1e-3, farther: 0.0 }));
        let follower = Follower::drop(&woven, &Drop { start }, &options());
        assert_eq!(follower.drape().stop, Stop::AtRest);
        follower
    };
    let mut follower = held(&rim);
    let near_m = rim.mean_distance_m(&follower.boundary());
    // the inner sheet is the true one, which nothing told
    let inner_m = root_mean_square(
        follower.drape().positions_m.iter().zip(&truth.drape().positions_m).map(|(a, b)| a - b),
    );
    assert_eq!(follower.release(), Stop::AtRest);
    let released_m = rim.mean_distance_m(&follower.boundary());
    println!("held {near_m:.2e}, inner {inner_m:.2e}, released {released_m:.2e} m");
    // observed: 0.06 and 0.16 mm, released 0.26; where the cloth has not slid freely first 0.52,
    // 1.56 and 2.03
    assert!(near_m < 0.2e-3 && inner_m < 0.5e-3, "{near_m} {inner_m}");
    assert!(near_m < released_m && released_m < 1e-3, "{released_m}");
    // a side that is said to be unknown, 20 mm off, pulls nowhere
    let moved = rim.points().iter().enumerate().map(|(index, point)| match index / 61 {
        2 => BoundaryPoint {
            position_m: point.position_m + Vector3::new(0.0, 20e-3, 0.0),
            sigma_m: 20e-3,
            observed: false,
        },
        _ => *point,
    });
    let unsure = held(&Boundary::new(moved.collect()).unwrap());
    let off_m = rim.mean_distance_m(&unsure.boundary());
    assert!(off_m < 1.5e-3, "{off_m}");
}

//! Cases of one test that do not wait for each other.

/// Looks at each case in a thread of its own, and passes on the first failure. The ranks of all tests
/// share the room that [`super::room::Room`] gives.
pub fn at_once<T: Send>(cases: impl IntoIterator<Item = T>, look: impl Fn(T) + Sync) {
    let look = &look;
    std::thread::scope(|scope| {
        for case in cases {
            scope.spawn(move || look(case));
        }
    });
}

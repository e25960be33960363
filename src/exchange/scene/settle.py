def settle(drape):
    """Lets the cloth come to rest. Gives the simulated seconds, and whether it rests.

    It rests where the vertices move by less than still_m in window_s, root mean square, twice in
    sequence.
    """
    rest = SCENE["at_rest"]
    before, still, time_s = drape.positions_m(), 0, 0.0
    while still < 2 and time_s < rest["most_s"]:
        drape.advance(rest["window_s"])
        time_s += rest["window_s"]
        now = drape.positions_m()
        moved_m = float(((now - before) ** 2).sum(axis=1).mean() ** 0.5)
        print(f"{time_s:5.1f} s: moved by {1e3 * moved_m:.3f} mm in {rest['window_s']} s", flush=True)
        still = still + 1 if moved_m < rest["still_m"] else 0
        before = now
    return time_s, still == 2


if __name__ == "__main__":
    main()

//! Graph, keys and staleness, driver, threads, channels and progress events

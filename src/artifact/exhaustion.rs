//! An allocator that says what happens where memory runs out.
//!
//! Rust's collections know no failed allocation: the run-time library ends the process with signal
//! 6, as it does for a bug. A store bears an end at any moment, so a clean end is all that is
//! needed: a program that puts [`Telling`] in the place of its allocator is asked to make one.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator; a failed allocation goes to the program's own function, which ends the
/// process.
///
/// # Examples
/// ```
/// use isospline_artifact::Telling;
///
/// #[global_allocator]
/// static ALLOCATOR: Telling = Telling::new(|bytes| {
///     eprintln!("no memory for {bytes} bytes");
///     std::process::exit(1)
/// });
/// assert_eq!(vec![1; 3].len(), 3);
/// ```
#[derive(Debug)]
pub struct Telling {
    on_failure: fn(usize) -> !,
}

impl Telling {
    /// `on_failure` has the number of bytes that were asked for. It is called on any thread and
    /// must get along without an allocation.
    pub const fn new(on_failure: fn(usize) -> !) -> Self {
        Self { on_failure }
    }

    fn checked(&self, block: *mut u8, bytes: usize) -> *mut u8 {
        if block.is_null() { (self.on_failure)(bytes) } else { block }
    }
}

#[expect(unsafe_code, reason = "allocators are unsafe; each call goes on to the system's own")]
// SAFETY: all blocks are the system's, with the layouts of the caller. Nothing here unwinds but
// `on_failure` by a panic, which would need a block for its message and so ends in an abort.
unsafe impl GlobalAlloc for Telling {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract, which is the same.
        let block = unsafe { System.alloc(layout) };
        self.checked(block, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract, which is the same.
        let block = unsafe { System.alloc_zeroed(layout) };
        self.checked(block, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller keeps the contract, which is the same; the block is the system's.
        let block = unsafe { System.realloc(block, layout, size) };
        self.checked(block, size)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract, which is the same; the block is the system's.
        unsafe { System.dealloc(block, layout) }
    }
}

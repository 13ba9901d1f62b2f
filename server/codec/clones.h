// The inner loops of the codec, compiled for more than one instruction set.
#pragma once

/// A function of which the loader takes the clone that the processor can run; all do the same whole-number arithmetic,
/// and the same operations on each double in the same order. What it calls is compiled with it. Clang knows no such
/// clones of what is inlined so, and sanitizers cannot run in the choice, which comes before they are set up.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define PNEUMA_CLONED [[gnu::target_clones("default", "arch=x86-64-v3"), gnu::flatten]]
#else
#define PNEUMA_CLONED
#endif

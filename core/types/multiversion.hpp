// Hot kernels are compiled twice, for the baseline and for AVX2, and the loader picks one: one binary runs everywhere.
// Both give the same bits: contraction is off (cmake/DlodCompiler.cmake) and reductions are never reassociated.
#pragma once

// Sanitizers intercept before the loader has resolved the clones; clang 14 lacks the attribute on templates.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(DLOD_SANITIZED)
#define DLOD_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define DLOD_MULTIVERSION
#endif

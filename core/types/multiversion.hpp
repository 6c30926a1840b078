// Hot kernels are compiled for the baseline and for AVX2, some for AVX-512 as well, and the loader picks one: one binary
// runs everywhere. All give the same bits: contraction is off (cmake/DlodCompiler.cmake) and reductions are never
// reassociated.
#pragma once

// Sanitizers intercept before the loader has resolved the clones; clang 14 lacks the attribute on templates.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(DLOD_SANITIZED)
#define DLOD_MULTIVERSION __attribute__((target_clones("arch=x86-64-v3", "default")))
/// For kernels of long rows with much arithmetic or many conditions: others gain nothing from AVX-512.
#define DLOD_MULTIVERSION_512 __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define DLOD_MULTIVERSION
#define DLOD_MULTIVERSION_512
#endif

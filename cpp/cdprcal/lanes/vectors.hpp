// Private to the library: several numbers side by side, so that one formula serves a pose and
// eight.
//
// A formula is a template over a Kind: One computes with double, the others with vectors of it.
// Functions that must be inlined are marked so, since a vector may only cross a call between
// functions for the same kind of processor (processor.hpp).
#pragma once

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>

#include "cdprcal/types.hpp"

// Vectors never cross a function that is called.
#pragma GCC diagnostic ignored "-Wpsabi"

#define CDPRCAL_INLINE __attribute__((always_inline)) inline
#define CDPRCAL_INLINE_LAMBDA __attribute__((always_inline))
// glibc's vector functions, to four units in the last place. Clang would pass their arguments as
// the processor without AVX does.
#if defined(__x86_64__) && defined(__GNUC__) && defined(__GLIBC__) && !defined(__clang__)
#if __GLIBC_PREREQ(2, 35)
#define CDPRCAL_HAS_LIBMVEC 1
#endif
#endif

namespace cdprcal::lanes {

/// Numbers side by side in memory, whatever the width of the processor's vectors.
inline constexpr int kLanes = 8;

using Vector4 = double __attribute__((vector_size(4 * sizeof(double))));
using Vector8 = double __attribute__((vector_size(8 * sizeof(double))));

template <typename V>
inline constexpr int count = sizeof(V) / sizeof(double);

#ifdef CDPRCAL_HAS_LIBMVEC
// Declared const: where a result is not used, it is not computed.
extern "C" {  // NOLINTBEGIN(readability-identifier-naming): the names of x86-64's vector ABI
Vector4 _ZGVdN4vv_atan2(Vector4, Vector4) __attribute__((const));
Vector4 _ZGVdN4v_sin(Vector4) __attribute__((const));
Vector4 _ZGVdN4v_cos(Vector4) __attribute__((const));
Vector8 _ZGVeN8vv_atan2(Vector8, Vector8) __attribute__((const));
Vector8 _ZGVeN8v_sin(Vector8) __attribute__((const));
Vector8 _ZGVeN8v_cos(Vector8) __attribute__((const));
}  // NOLINTEND(readability-identifier-naming)
#endif

/// A number alone.
struct One {
  using V = double;
  static CDPRCAL_INLINE V sqrt(V x) { return std::sqrt(x); }
  static CDPRCAL_INLINE V atan2(V y, V x) { return std::atan2(y, x); }
};

/// Vectors whose functions are done number by number.
template <typename Vector>
struct Plain {
  using V = Vector;
  static CDPRCAL_INLINE V sqrt(const V& x) {
    V out;
    for (int l = 0; l < count<V>; ++l) out[l] = std::sqrt(x[l]);
    return out;
  }
  static CDPRCAL_INLINE V atan2(const V& y, const V& x) {
    V out;
    for (int l = 0; l < count<V>; ++l) out[l] = std::atan2(y[l], x[l]);
    return out;
  }
  static CDPRCAL_INLINE V sin(const V& x) {
    V out;
    for (int l = 0; l < count<V>; ++l) out[l] = std::sin(x[l]);
    return out;
  }
  static CDPRCAL_INLINE V cos(const V& x) {
    V out;
    for (int l = 0; l < count<V>; ++l) out[l] = std::cos(x[l]);
    return out;
  }
};

using Anywhere = Plain<Vector4>;
#ifdef CDPRCAL_HAS_LIBMVEC
struct Avx2 : Plain<Vector4> {
  static CDPRCAL_INLINE V atan2(const V& y, const V& x) { return _ZGVdN4vv_atan2(y, x); }
  static CDPRCAL_INLINE V sin(const V& x) { return _ZGVdN4v_sin(x); }
  static CDPRCAL_INLINE V cos(const V& x) { return _ZGVdN4v_cos(x); }
};
struct Avx512 : Plain<Vector8> {
  static CDPRCAL_INLINE V atan2(const V& y, const V& x) { return _ZGVeN8vv_atan2(y, x); }
  static CDPRCAL_INLINE V sin(const V& x) { return _ZGVeN8v_sin(x); }
  static CDPRCAL_INLINE V cos(const V& x) { return _ZGVeN8v_cos(x); }
};
#else
using Avx2 = Plain<Vector4>;
using Avx512 = Plain<Vector8>;
#endif

/// Which lanes hold a number that is finite.
template <typename V>
CDPRCAL_INLINE auto finite(const V& x) {
  return x - x == V{};
}

/// Whether a condition holds in all lanes.
template <typename Mask>
CDPRCAL_INLINE bool all(const Mask& condition) {
  bool out = true;
  for (std::size_t l = 0; l < sizeof(Mask) / sizeof(condition[0]); ++l) out &= condition[l] != 0;
  return out;
}

/// The same angle in [−π, π].
template <typename V>
CDPRCAL_INLINE V wrap_angle(const V& angle_rad) {
  constexpr double kRound = 6755399441055744.0;  // 1.5 · 2⁵²: adding it rounds to integers
  const V turns = (angle_rad * (0.5 / kPi) + kRound) - kRound;
  return angle_rad - turns * (2.0 * kPi);
}

/// The same lanes, from `first` on, of every number of an array [index][kLanes].
template <typename V>
class Lanes {
 public:
  CDPRCAL_INLINE Lanes(const double* numbers, int first) : numbers_(numbers + first) {}
  CDPRCAL_INLINE V operator[](int index) const {
    V out;
    std::memcpy(&out, numbers_ + index * kLanes, sizeof out);
    return out;
  }

 private:
  const double* numbers_;
};
template <typename V>
class WritableLanes {
 public:
  CDPRCAL_INLINE WritableLanes(double* numbers, int first) : numbers_(numbers + first) {}
  CDPRCAL_INLINE V operator[](int index) const { return Lanes<V>(numbers_, 0)[index]; }
  CDPRCAL_INLINE void set(int index, const V& value) const {
    std::memcpy(numbers_ + index * kLanes, &value, sizeof value);
  }
  CDPRCAL_INLINE void add(int index, const V& value) const { set(index, (*this)[index] + value); }

 private:
  double* numbers_;
};

struct Free {
  void operator()(double* memory) const { std::free(memory); }
};
/// Aligned for vectors, and not touched before it is written.
using Buffer = std::unique_ptr<double[], Free>;

/// Room for `numbers` numbers of kLanes lanes each; throws std::bad_alloc.
inline Buffer buffer(std::size_t numbers) {
  constexpr std::size_t kAlignment = kLanes * sizeof(double);
  void* memory = std::aligned_alloc(kAlignment, numbers * kAlignment);
  if (memory == nullptr) throw std::bad_alloc();
  return Buffer(static_cast<double*>(memory));
}

/// Batches of kLanes that `poses` poses fill.
constexpr std::size_t batches(std::size_t poses) { return (poses + kLanes - 1) / kLanes; }

}  // namespace cdprcal::lanes

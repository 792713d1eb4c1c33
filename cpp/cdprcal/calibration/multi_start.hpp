// A first fit without anyone's guess: from as many starts as it takes.
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// Solves from guesses of ζ0 in turn until a minimum agrees with the readings, two starts agree on
/// one that does not, or `most_starts` were tried; returns the best. First as §3.3 has it: ζ0 of
/// τ0, ideal poses at rest, estimated ones in motion; then all poses estimated, from there and from
/// other ζ0. `initial`: the only ζ0 to start from. iterations are those of the best start,
/// solve_time_s of all. `ends`, if given, gets what each start ended in.
CalibrationResult solve_from_starts(const CalibrationProblem& problem,
                                    const std::optional<Pose>& initial, int most_starts,
                                    const SolveOptions& options,
                                    std::vector<CalibrationResult>* ends = nullptr);

/// The same once more where no minimum agreed with the readings (`nowhere`): from guesses of ζ0 all
/// over the workspace. The best of all.
CalibrationResult solve_from_anywhere(const CalibrationProblem& problem,
                                      const SolveOptions& options, CalibrationResult nowhere);

/// What `most_starts` of these starts end in, trusted or not: one of each place, the lowest cost
/// first. `ends`: of the first starts, which are not solved again. solve_time_s of the first is
/// that of the others.
std::vector<CalibrationResult> minima_from_starts(const CalibrationProblem& problem,
                                                  int most_starts, const SolveOptions& options,
                                                  std::vector<CalibrationResult> ends = {});

/// Two fits whose costs differ by less are both possible: a likelihood ratio of a thousand.
constexpr double kDecisive = 7.0;

/// A fit that is given up where it will not come below `cost` plus kDecisive: starts far from any
/// minimum creep along ravines for thousands of steps.
CalibrationResult solve_unless_hopeless(const CalibrationProblem& problem,
                                        const std::vector<Pose>& guess, const SolveOptions& options,
                                        double cost);

/// Whether two fits ended in one place.
bool same_minimum(const CalibrationResult& a, const CalibrationResult& b);

}  // namespace cdprcal

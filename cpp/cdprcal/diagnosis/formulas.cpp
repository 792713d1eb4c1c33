#include "cdprcal/diagnosis/formulas.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <numbers>
#include <set>

#include "cdprcal/effects/text_effect.hpp"

namespace cdprcal {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// A channel that a formula may add to. Size to expect as of the dependences of generic.cpp.
struct Target {
  const char* target;
  Channel channel;
  const char* word;
  const char* unit;
  bool per_cable;
  double typical;
  Yardstick of;
};
constexpr std::array<Target, 6> kTargets{{
    {"length_m", Channel::length, "length", "m", true, 3e-3, Yardstick::frame},
    {"swivel_rad", Channel::swivel, "swivel", "rad", true, 0.01, Yardstick::none},
    {"tension_N", Channel::balance, "tension", "N", true, 4.0, Yardstick::weight},
    {"roll_rad", Channel::roll_pitch, "roll", "rad", false, 0.01, Yardstick::none},
    {"pitch_rad", Channel::roll_pitch, "pitch", "rad", false, 0.01, Yardstick::none},
    {"yaw_rad", Channel::yaw, "yaw", "rad", false, 0.03, Yardstick::none},
}};

/// What it may depend on, and what a law in it may look like.
struct Covariate {
  const char* name;
  const char* word;
  const char* unit;
  bool per_cable;
  bool bends;       ///< beside straight lines: powers, steps and kinks
  bool turns;       ///< an angle: sines of one and two turns
  bool goes_round;  ///< a length over a drum: sines of any period
};
constexpr std::array<Covariate, 12> kCovariates{{
    {"length_m", "length", "m", true, true, false, true},
    {"swivel_rad", "swivel", "rad", true, true, true, false},
    {"tension_N", "tension", "N", true, true, false, false},
    {"length_direction", "direction", "", true, false, false, false},
    {"swivel_direction", "swivel_direction", "", true, false, false, false},
    {"x_m", "x", "m", false, true, false, false},
    {"y_m", "y", "m", false, true, false, false},
    {"z_m", "z", "m", false, true, false, false},
    {"roll_rad", "roll", "rad", false, true, true, false},
    {"pitch_rad", "pitch", "rad", false, true, true, false},
    {"yaw_rad", "yaw", "rad", false, true, true, false},
    {"time_s", "time", "s", false, true, false, false},
}};
constexpr std::size_t kTension = 2, kX = 5, kRoll = 8, kTime = 11;

/// What the runs visited of each covariate.
struct Visited {
  std::vector<double> values;                  ///< sorted
  std::vector<std::vector<double>> of_cables;  ///< the same, each cable's; one list for all
  double middle = 0.0, spread = 0.0;
  [[nodiscard]] double low() const { return values.front(); }
  [[nodiscard]] double high() const { return values.back(); }
  [[nodiscard]] double quantile(double share) const {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  }
  [[nodiscard]] bool varies() const { return spread > 1e-9; }
  /// Whether enough lies on both sides of a place, in every cable or in all: else what begins there
  /// would stand for single readings.
  [[nodiscard]] bool divides(double place, bool each) const {
    constexpr std::ptrdiff_t kEnough = 3;
    const auto enough = [&](const std::vector<double>& of) {
      const auto above = std::ranges::count_if(of, [&](double v) { return v > place; });
      return above >= kEnough && std::ssize(of) - above >= kEnough;
    };
    return each ? std::ranges::all_of(of_cables, enough) : enough(values);
  }
};
using AllVisited = std::array<Visited, kCovariates.size()>;

double spread_of(const std::vector<double>& values, double& middle) {
  middle = 0.0;
  for (const double v : values) middle += v / static_cast<double>(values.size());
  double squares = 0.0;
  for (const double v : values) squares += (v - middle) * (v - middle);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

/// Values of a covariate at a pose; of the cables in turn, or one.
std::vector<double> values_at(std::size_t covariate, const DiagnosisModel& model,
                              const PlatformState& state, const Pose& pose, const Measurement& m) {
  const auto of_cables = [&](const auto& get) {
    std::vector<double> out;
    for (int i = 0; i < model.robot.cable_count(); ++i) out.push_back(get(i));
    return out;
  };
  const auto entry = [](const CableVector& values, int i) {
    return values.size() > i ? values[i] : kNaN;
  };
  switch (covariate) {
    case 0:
      return of_cables([&](int i) { return state.cable[i].length_m; });
    case 1:
      return of_cables([&](int i) { return state.cable[i].swivel_rad; });
    case 2:
      return of_cables([&](int i) { return entry(m.tension_N, i); });
    case 3:
      return of_cables([&](int i) { return entry(m.length_direction, i); });
    case 4:
      return of_cables([&](int i) { return entry(m.swivel_direction, i); });
    case kTime:
      return {m.run_time_s};
    default:
      break;
  }
  if (covariate < kRoll) return {pose.position_m[static_cast<Eigen::Index>(covariate - kX)]};
  const Vector3 angles = euler_from_rotation(state.rotation, model.robot.euler_convention);
  return {angles[static_cast<Eigen::Index>(covariate - kRoll)]};
}

AllVisited visited_by(const DiagnosisModel& model) {
  AllVisited out;
  for (const DiagnosisRun& run : model.runs) {
    for (std::size_t k = 0; k < run.measurements.size(); ++k) {
      if (is_moving(run.measurements[k])) continue;
      const PlatformState state = platform_state(model.robot, run.poses[k]);
      if (!state.valid) continue;
      for (std::size_t c = 0; c < kCovariates.size(); ++c) {
        const std::vector<double> now =
            values_at(c, model, state, run.poses[k], run.measurements[k]);
        out[c].of_cables.resize(now.size());
        for (std::size_t i = 0; i < now.size(); ++i) {
          if (!std::isfinite(now[i])) continue;
          out[c].values.push_back(now[i]);
          out[c].of_cables[i].push_back(now[i]);
        }
      }
    }
  }
  for (Visited& v : out) {
    if (v.values.size() < 2) continue;
    std::ranges::sort(v.values);
    v.spread = spread_of(v.values, v.middle);
  }
  return out;
}

/// A name without its constants.
std::string without_digits(std::string name) {
  std::erase_if(name, [](char c) { return c >= '0' && c <= '9'; });
  return name;
}

/// One term of a law: its parameter, its function, and how large that is over the runs.
struct Term {
  std::string parameter, function;
  double size = 1.0;
};

/// Writes laws down as effects, common to the cables or one a cable.
class Writer {
 public:
  Writer(const DiagnosisModel& model, const AllVisited& visited)
      : model_(model), visited_(visited) {}

  /// `pair`: channel and variables; `kind`: of law, of which there may be several that differ in
  /// constants.
  void add(const Target& channel, const std::string& pair, const std::string& kind, bool by_run,
           const std::vector<Term>& terms, bool also_each = true) {
    write(channel, pair + kind, by_run, terms, false);
    if (channel.per_cable && also_each) write(channel, pair + kind + "_each", by_run, terms, true);
    while (kinds_.size() < out.size())
      kinds_.emplace_back(channel.word + pair, without_digits(kind));
  }

  /// Takes what was written, with its prior.
  [[nodiscard]] std::vector<Formula> take() const {
    std::map<std::string, std::map<std::string, int>> variants;
    for (const auto& [pair, kind] : kinds_) ++variants[pair][kind];
    std::vector<Formula> formulas;
    for (std::size_t k = 0; k < out.size(); ++k) {
      const auto& kinds = variants.at(kinds_[k].first);
      const double share = static_cast<double>(variants.size()) *
                           static_cast<double>(kinds.size()) * kinds.at(kinds_[k].second);
      formulas.push_back({out[k], -std::log(share)});
    }
    return formulas;
  }

  void of_one(const Target& channel, std::size_t c) {
    const Covariate& v = kCovariates[c];
    const Visited& seen = visited_[c];
    const std::string by = std::string("_by_") + v.word;
    const std::string x = v.name;
    const bool run = c == kTime;
    const double range = seen.high() - seen.low();
    add(channel, by, "_line", run, {{slope(channel, v), x, seen.spread}});
    if (v.bends) {
      // About the middle of what was visited, and about zero, where they differ.
      const bool about_zero = std::abs(seen.middle) < 0.05 * seen.spread;
      const double middle = about_zero ? 0.0 : std::stod(number(seen.middle));
      const std::string off = about_zero ? x : "(" + x + " - " + number(middle) + ")";
      const double square = seen.spread * seen.spread;
      const double whole = square + 2.0 * std::abs(seen.middle) * seen.spread;
      add(channel, by, "_square", run, {{curve(channel, v), off + "^2", square}});
      if (!about_zero) {
        add(channel, by, "_square_of_all", run, {{curve(channel, v), x + "^2", whole}});
      }
      add(channel, by, "_bent", run,
          {{slope(channel, v), off, seen.spread}, {curve(channel, v), off + "^2", square}});
      add(channel, by, "_cube", run, {{"cubic", off + "^3", square * seen.spread}});
      for (const double share : {0.2, 0.35, 0.5, 0.65, 0.8}) {
        const std::string from = number(seen.quantile(share));
        const auto divides = [&](bool each) { return seen.divides(std::stod(from), each); };
        if (!divides(false)) continue;
        add(channel, by, "_step_at_" + from, run,
            {{"size_" + std::string(channel.unit), "step(" + x + " - " + from + ")", 1.0}},
            divides(true));
        add(channel, by, "_kink_at_" + from, run,
            {{slope(channel, v), "max(" + x + " - " + from + ", 0)", 0.5 * range}}, divides(true));
      }
    }
    if (c == kTension) {
      add(channel, by, "_inverse", run,
          {{"inverse", "1 / max(" + x + ", " + number(0.1 * seen.middle) + ")",
            seen.spread / (seen.middle * seen.middle)}});
    }
    if (c == kTime) of_time(channel, range);
    if (v.turns) {
      for (const int times : {1, 2, 3}) sine(channel, c, kTurn / times);
    }
    // What goes round on a drum is read by the drum's encoder.
    if (v.goes_round && channel.target == std::string_view(v.name)) {
      constexpr double kShortest_m = 0.05;  // a drum of 8 mm radius, on irma4
      const double shortest_m = kShortest_m * times_reference(Yardstick::frame, model_.robot);
      const double step = 1.0 / (4.0 * range);
      for (double f = 0.5 / range; f < 1.0 / shortest_m; f += step) sine(channel, c, 1.0 / f);
    } else if (c >= kX && c < kX + 3 && !channel.per_cable) {  // a field from place to place
      for (const double waves : {0.5, 0.75, 1.0, 1.5, 2.0}) sine(channel, c, range / waves);
    }
  }

  void sine(const Target& channel, std::size_t c, double period) {
    const Covariate& v = kCovariates[c];
    const std::string phase = v.unit == std::string("rad")
                                  ? number(kTurn / period) + " * " + v.name
                                  : "2 * pi * " + std::string(v.name) + " / " + number(period);
    add(channel, std::string("_by_") + v.word, "_sine_" + number(period), c == kTime,
        {{"sine_" + std::string(channel.unit), "sin(" + phase + ")", 0.7},
         {"cosine_" + std::string(channel.unit), "cos(" + phase + ")", 0.7}});
  }

  void of_two(const Target& channel, std::size_t a, std::size_t b) {
    const Covariate& u = kCovariates[a];
    const Covariate& v = kCovariates[b];
    const double size = visited_[a].spread * visited_[b].spread +
                        std::abs(visited_[a].middle) * visited_[b].spread +
                        std::abs(visited_[b].middle) * visited_[a].spread;
    add(channel, "_by_product", std::string("_of_") + u.word + "_and_" + v.word,
        a == kTime || b == kTime, {{"product", std::string(u.name) + " * " + v.name, size}});
  }

  Candidates out;

 private:
  static std::string slope(const Target& channel, const Covariate& v) {
    return std::string("slope_") + channel.unit + (*v.unit ? "_" : "") + v.unit;
  }
  static std::string curve(const Target& channel, const Covariate& v) {
    return std::string("curve_") + channel.unit + "_" + v.unit + "2";
  }
  void of_time(const Target& channel, double range_s) {
    for (const double share : {0.05, 0.15, 0.4}) {
      const std::string constant_s = number(share * range_s);
      add(channel, "_by_time", "_settling_" + constant_s, true,
          {{"size_" + std::string(channel.unit), "(1 - exp(-time_s / " + constant_s + "))", 0.3}});
      add(channel, "_by_time", "_creep_" + constant_s, true,
          {{"decade_" + std::string(channel.unit), "log10(1 + time_s / " + constant_s + ")", 0.3}});
    }
  }

  void write(const Target& channel, const std::string& what, bool by_run,
             const std::vector<Term>& terms, bool each) {
    EffectDefinition d;
    d.name = channel.word + what;
    std::ranges::replace_if(d.name, [](char c) { return c == '.' || c == '-' || c == '+'; }, '_');
    if (!names_.insert(d.name).second) return;  // of two places that are the same
    d.scope = by_run ? EffectScope::run : EffectScope::robot;
    const double typical = channel.typical * times_reference(channel.of, model_.robot);
    std::string formula;
    for (const Term& term : terms) {
      if (!(term.size > 1e-12)) return;
      constexpr double kWidest = 50.0;
      d.parameters.push_back(
          {term.parameter, each, typical / term.size, kWidest * typical / term.size});
      formula += (formula.empty() ? "" : " + ") + term.parameter + " * " + term.function;
    }
    d.adds = {{channel.target, formula}};
    d.settle = "look for something on the robot that would do so";
    d.remedy = "keep the formula in the robot file until its cause is found";
    out.push_back(text_effect(d, Trust::ours));
  }

  const DiagnosisModel& model_;
  const AllVisited& visited_;
  std::vector<std::pair<std::string, std::string>> kinds_;  ///< pair and kind, beside `out`
  std::set<std::string> names_;
};

bool is_read(const DiagnosisModel& model, const Target& channel) {
  const std::string_view word = channel.word;
  return std::ranges::any_of(model.runs, [&](const DiagnosisRun& run) {
    return std::ranges::any_of(run.measurements, [&](const Measurement& m) {
      if (word == "length") return m.length_m.array().isFinite().any();
      if (word == "swivel") return m.swivel_rad.array().isFinite().any();
      if (word == "tension") return m.tension_N.array().isFinite().any();
      return std::isfinite(m.roll_pitch_yaw_rad[word == "roll" ? 0 : word == "pitch" ? 1 : 2]);
    });
  });
}

/// Scores of many formulas: so many at a time, or their columns would take much memory.
std::vector<LikelyFormula> scan_all(const DiagnosisModel& model, const std::vector<Formula>& all) {
  constexpr std::size_t kAtATime = 128;
  std::vector<LikelyFormula> scores;
  std::map<const Effect*, double> prior;
  for (const Formula& formula : all) prior[formula.effect.get()] = formula.log_prior;
  for (std::size_t begin = 0; begin < all.size(); begin += kAtATime) {
    Candidates some;
    for (std::size_t k = begin; k < std::min(begin + kAtATime, all.size()); ++k) {
      some.push_back(all[k].effect);
    }
    for (CandidateScore& s : scan(model, some, {.draws = 0})) {
      if (!std::isfinite(s.log_evidence)) continue;
      const double log_prior = prior.at(s.effect.get());
      scores.push_back({std::move(s), log_prior});
    }
  }
  std::ranges::stable_sort(scores, std::ranges::greater(), [](const LikelyFormula& f) {
    return f.score.log_evidence + f.log_prior;
  });
  return scores;
}

/// The period that a formula has in its name; 0 where it has none.
double period_of(const EffectDefinition& definition) {
  const std::string& formula = definition.adds.front().formula;
  const std::size_t at = formula.find("sin(2 * pi * ");
  if (at == std::string::npos) return 0.0;
  const std::size_t over = formula.find(" / ", at);
  return std::stod(formula.substr(over + 3));
}

/// What a law may be on a machine, by how its name begins; the first that fits.
struct Meaning {
  const char* begins;
  const char* words;
};
constexpr std::array<Meaning, 21> kMeanings{{
    {"length_by_length_", "layers of cable on the drum, or a drum that is no cylinder"},
    {"length_by_direction_", "backlash between encoder and drum"},
    {"length_by_tension_", "a cable or frame that gives way under load"},
    {"length_by_time_", "cables that creep, or warm up"},
    {"length_by_swivel_direction_", "cable that lags in the swivel's guide"},
    {"length_by_swivel_", "a pulley that does not swivel about the cable's entry"},
    {"swivel_by_swivel_direction_", "play or friction of the swivels, each its own"},
    {"swivel_by_swivel_", "a swivel encoder that sits off its axis, or has a wrong scale"},
    {"swivel_by_tension_", "a swivel bearing that gives way under load"},
    {"swivel_by_time_", "a swivel encoder that drifts"},
    {"tension_by_tension_", "load cells that are not straight"},
    {"tension_by_time_", "load cells that drift or warm up"},
    {"tension_by_direction_", "friction between platform and load cell"},
    {"tension_by_swivel_", "load cells that feel sideways load"},
    {"yaw_by_yaw_", "iron near the magnetometer, or a wrong scale"},
    {"yaw_by_x_", "a magnetic field that differs from place to place"},
    {"yaw_by_y_", "a magnetic field that differs from place to place"},
    {"yaw_by_z_", "a magnetic field that differs from place to place"},
    {"yaw_by_time_", "a yaw that drifts or settles"},
    {"roll_by_",
     "an attitude sensor with a wrong scale, or one that tilts with the platform's place"},
    {"pitch_by_",
     "an attitude sensor with a wrong scale, or one that tilts with the platform's place"},
}};

}  // namespace

bool scatters(const DiagnosisModel& model, NoiseGroup group) {
  constexpr double kExcess = 1.5;
  const auto c = static_cast<std::size_t>(group);
  return model.noise[c] > kExcess * model.floor[c];
}

bool scatters(const DiagnosisModel& model) {
  return std::ranges::any_of(kTargets, [&](const Target& channel) {
    return is_read(model, channel) && scatters(model, at_rest(channel.channel));
  });
}

std::vector<Formula> formula_candidates(const DiagnosisModel& model) {
  const AllVisited visited = visited_by(model);
  Writer writer(model, visited);
  const auto may = [&](const Target& channel, std::size_t c) {
    return visited[c].varies() && (channel.per_cable || !kCovariates[c].per_cable);
  };
  const bool any = scatters(model);
  for (const Target& channel : kTargets) {
    if (!is_read(model, channel)) continue;
    if (any && !scatters(model, at_rest(channel.channel))) continue;
    for (std::size_t c = 0; c < kCovariates.size(); ++c) {
      if (may(channel, c)) writer.of_one(channel, c);
    }
    for (std::size_t a = 0; a < kCovariates.size(); ++a) {
      for (std::size_t b = a + 1; b < kCovariates.size(); ++b) {
        if (may(channel, a) && may(channel, b)) writer.of_two(channel, a, b);
      }
    }
  }
  return writer.take();
}

std::vector<LikelyFormula> likely_formulas(const DiagnosisModel& model, std::size_t count) {
  std::vector<LikelyFormula> likely;
  std::set<std::string> kinds;
  for (LikelyFormula& found : scan_all(model, formula_candidates(model))) {
    if (likely.size() == count) break;
    const bool is_new = kinds.insert(without_digits(found.score.effect->name())).second;
    if (is_new) likely.push_back(std::move(found));
  }
  const AllVisited visited = visited_by(model);
  for (LikelyFormula& found : likely) {
    const EffectDefinition& definition = *definition_of(*found.score.effect);
    const double period = period_of(definition);
    if (period == 0.0) continue;
    const auto channel = std::ranges::find_if(
        kTargets, [&](const Target& c) { return definition.adds.front().to == c.target; });
    const auto covariate = std::ranges::find_if(kCovariates, [&](const Covariate& c) {
      return definition.adds.front().formula.find("pi * " + std::string(c.name)) !=
             std::string::npos;
    });
    const auto c = static_cast<std::size_t>(covariate - kCovariates.begin());
    const double step = 1.0 / (4.0 * (visited[c].high() - visited[c].low()));
    Writer finer(model, visited);
    for (int k = -8; k <= 8; ++k) finer.sine(*channel, c, 1.0 / (1.0 / period + k * step / 10.0));
    std::vector<Formula> same;
    for (const auto& effect : finer.out) {
      if (definition_of(*effect)->parameters.front().per_cable ==
          definition.parameters.front().per_cable) {
        same.push_back({effect, found.log_prior});
      }
    }
    const std::vector<LikelyFormula> precise = scan_all(model, same);
    if (!precise.empty() && precise.front().score.log_evidence > found.score.log_evidence) {
      found = precise.front();
    }
  }
  return likely;
}

std::shared_ptr<const Effect> with_meaning(const std::shared_ptr<const Effect>& formula,
                                           const Eigen::VectorXd& values) {
  EffectDefinition definition = *definition_of(*formula);
  std::string meaning;
  for (const Meaning& row : kMeanings) {
    if (definition.name.starts_with(row.begins) && meaning.empty()) meaning = row.words;
  }
  if (const double period_m = period_of(definition);
      period_m > 0.0 && definition.name.starts_with("length_by_length_")) {
    const Eigen::Index half = values.size() / 2;  // sines, then cosines
    const double out_m =
        (values.head(half).array().square() + values.tail(half).array().square()).sqrt().maxCoeff();
    char text[160];
    std::snprintf(text, sizeof text, "a drum of %.3g mm radius that runs out by %.2g mm",
                  1e3 * period_m / kTurn, 1e3 * out_m);
    meaning = text;
  }
  definition.sentence = definition.adds.front().to + " += " + definition.adds.front().formula +
                        (meaning.empty() ? "" : ": may be " + meaning);
  return text_effect(definition, Trust::ours);
}

}  // namespace cdprcal

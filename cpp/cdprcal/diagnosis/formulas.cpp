#include "cdprcal/diagnosis/formulas.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <set>

#include "cdprcal/diagnosis/generic.hpp"
#include "cdprcal/diagnosis/motion.hpp"
#include "cdprcal/diagnosis/turns.hpp"
#include "cdprcal/effects/text_effect.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

std::string number(double value) { return printed("%.4g", value); }

/// A channel that a formula may add to.
struct Target {
  const char* target;
  Channel channel;
  const char* word;
  const char* unit;
  bool per_cable;
};
constexpr std::array<Target, 6> kTargets{{
    {"length_m", Channel::length, "length", "m", true},
    {"swivel_rad", Channel::swivel, "swivel", "rad", true},
    {"tension_N", Channel::balance, "tension", "N", true},
    {"roll_rad", Channel::roll_pitch, "roll", "rad", false},
    {"pitch_rad", Channel::roll_pitch, "pitch", "rad", false},
    {"yaw_rad", Channel::yaw, "yaw", "rad", false},
}};

/// A rest, as covariates look at it.
struct Rest {
  const PlatformState& state;
  const Pose& pose;
  const Measurement& measurement;
  Vector3 angles_rad;
};

double entry(const CableVector& values, int cable) {
  return values.size() > cable ? values[cable] : kNaN;
}

/// What a law in it may look like, beside a straight line.
enum class Nature { direction, drum, angle, pull, place, time };

/// What a channel may depend on.
struct Covariate {
  const char* name;
  const char* word;
  const char* unit;
  bool per_cable;
  Nature nature;
  double (*at)(const Rest&, int cable);
};
constexpr bool kEach = true, kOne = false;
constexpr std::array<Covariate, 12> kCovariates{{
    {"length_m", "length", "m", kEach, Nature::drum,
     [](const Rest& r, int i) { return r.state.cable[static_cast<std::size_t>(i)].length_m; }},
    {"swivel_rad", "swivel", "rad", kEach, Nature::angle,
     [](const Rest& r, int i) { return r.state.cable[static_cast<std::size_t>(i)].swivel_rad; }},
    {"tension_N", "tension", "N", kEach, Nature::pull,
     [](const Rest& r, int i) { return entry(r.measurement.tension_of_laws_N(), i); }},
    {"length_direction", "direction", "", kEach, Nature::direction,
     [](const Rest& r, int i) { return entry(r.measurement.length_direction, i); }},
    {"swivel_direction", "swivel_direction", "", kEach, Nature::direction,
     [](const Rest& r, int i) { return entry(r.measurement.swivel_direction, i); }},
    {"x_m", "x", "m", kOne, Nature::place,
     [](const Rest& r, int) { return r.pose.position_m.x(); }},
    {"y_m", "y", "m", kOne, Nature::place,
     [](const Rest& r, int) { return r.pose.position_m.y(); }},
    {"z_m", "z", "m", kOne, Nature::place,
     [](const Rest& r, int) { return r.pose.position_m.z(); }},
    {"roll_rad", "roll", "rad", kOne, Nature::angle,
     [](const Rest& r, int) { return r.angles_rad[0]; }},
    {"pitch_rad", "pitch", "rad", kOne, Nature::angle,
     [](const Rest& r, int) { return r.angles_rad[1]; }},
    {"yaw_rad", "yaw", "rad", kOne, Nature::angle,
     [](const Rest& r, int) { return r.angles_rad[2]; }},
    {"time_s", "time", "s", kOne, Nature::time,
     [](const Rest& r, int) { return r.measurement.run_time_s; }},
}};

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
  /// The middles between neighbouring values, as many as are worth trying.
  [[nodiscard]] std::vector<double> between() const {
    constexpr std::size_t kMost = 48;
    const std::size_t every = 1 + values.size() / kMost;
    std::vector<double> out;
    for (std::size_t i = every; i < values.size(); i += every) {
      out.push_back(0.5 * (values[i - 1] + values[i]));
    }
    return out;
  }
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

AllVisited visited_by(const DiagnosisModel& model) {
  AllVisited out;
  for (const DiagnosisRun& run : model.runs) {
    for (std::size_t k = 0; k < run.measurements.size(); ++k) {
      if (is_moving(run.measurements[k])) continue;
      const PlatformState state = platform_state(model.robot, run.poses[k]);
      if (!state.valid) continue;
      const Rest rest{state, run.poses[k], run.measurements[k],
                      euler_from_rotation(state.rotation, model.robot.euler_convention)};
      for (std::size_t c = 0; c < kCovariates.size(); ++c) {
        const int count = kCovariates[c].per_cable ? model.robot.cable_count() : 1;
        out[c].of_cables.resize(static_cast<std::size_t>(count));
        for (int i = 0; i < count; ++i) {
          const double value = kCovariates[c].at(rest, i);
          if (!std::isfinite(value)) continue;
          out[c].values.push_back(value);
          out[c].of_cables[static_cast<std::size_t>(i)].push_back(value);
        }
      }
    }
  }
  for (Visited& v : out) {
    if (v.values.size() < 2) continue;
    std::ranges::sort(v.values);
    v.spread = spread_of(v.values, v.middle);
  }
  const std::array<bool, 3> turns = angles_that_vary(model);
  for (std::size_t c = 0, angle = 0; c < kCovariates.size(); ++c) {
    if (kCovariates[c].per_cable || kCovariates[c].nature != Nature::angle) continue;
    if (!turns[angle++]) out[c].spread = 0.0;
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
    const bool run = v.nature == Nature::time;
    const double range = seen.high() - seen.low();
    add(channel, by, "_line", run, {{slope(channel, v), x, seen.spread}});
    if (v.nature != Nature::direction) {
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
      const auto begin = [&](double where, const char* kind, const auto& term) {
        const std::string from = number(where);
        const double place = std::stod(from);
        if (!seen.divides(place, false)) return;
        add(channel, by, kind + from, run, {term(from)}, seen.divides(place, true));
      };
      const auto step = [&](const std::string& from) -> Term {
        // What is knocked or set anew changes at once, and by any size.
        return {"size_" + std::string(channel.unit), "step(" + x + " - " + from + ")",
                run ? 0.1 : 1.0};
      };
      const auto kink = [&](const std::string& from) -> Term {
        return {slope(channel, v), "max(" + x + " - " + from + ", 0)", 0.5 * range};
      };
      for (const double share : {0.2, 0.35, 0.5, 0.65, 0.8}) {
        if (!run) begin(seen.quantile(share), "_step_at_", step);
        begin(seen.quantile(share), "_kink_at_", kink);
      }
      if (run) {  // between any two rests
        for (const double time_s : seen.between()) begin(time_s, "_step_at_", step);
      }
    }
    if (v.nature == Nature::pull) {
      add(channel, by, "_inverse", run,
          {{"inverse", "1 / max(" + x + ", " + number(0.1 * seen.middle) + ")",
            seen.spread / (seen.middle * seen.middle)}});
    }
    if (run) of_time(channel, range);
    if (v.nature == Nature::angle) {
      for (const int times : {1, 2, 3}) sine(channel, c, kTurn / times);
    }
    // What goes round on a drum is read by the drum's encoder.
    if (v.nature == Nature::drum && channel.target == std::string_view(v.name)) {
      constexpr double kShortest_m = 0.05;  // a drum of 8 mm radius, on irma4
      constexpr double kMostTurns = 1000.0;
      const double shortest_m = kShortest_m * times_reference(Yardstick::frame, model_.robot);
      // No cable of this frame travels so far: the lengths are of another unit.
      const bool is_travel = range < kMostTurns * shortest_m;
      const double step = 1.0 / (4.0 * range);
      for (double f = 0.5 / range; is_travel && f < 1.0 / shortest_m; f += step) {
        sine(channel, c, 1.0 / f);
      }
    } else if (v.nature == Nature::place && !channel.per_cable) {  // a field from place to place
      for (const double waves : {0.5, 0.75, 1.0, 1.5, 2.0}) sine(channel, c, range / waves);
    }
  }

  void sine(const Target& channel, std::size_t c, double period) {
    const Covariate& v = kCovariates[c];
    const std::string phase = v.unit == std::string("rad")
                                  ? number(kTurn / period) + " * " + v.name
                                  : "2 * pi * " + std::string(v.name) + " / " + number(period);
    add(channel, std::string("_by_") + v.word, "_sine_" + number(period), v.nature == Nature::time,
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
        u.nature == Nature::time || v.nature == Nature::time,
        {{"product", std::string(u.name) + " * " + v.name, size}});
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
    const DependenceSize size = dependence_size(channel.channel);
    const double typical = size.typical * times_reference(size.of, model_.robot);
    std::string formula;
    for (const Term& term : terms) {
      if (!(term.size > 1e-12)) return;
      constexpr double kWidest = 50.0;
      d.parameters.push_back(
          {term.parameter, each, typical / term.size, kWidest * typical / term.size});
      add_item(formula, term.parameter + " * " + term.function, " + ");
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

/// Scores of many formulas: so many at a time, or their columns would take much memory.
std::vector<LikelyFormula> scan_all(const DiagnosisModel& model, const std::vector<Formula>& all) {
  constexpr std::size_t kAtATime = 128;
  std::vector<LikelyFormula> scores;
  std::map<const Effect*, double> prior;
  Candidates effects;
  for (const Formula& formula : all) {
    effects.push_back(formula.effect);
    prior[formula.effect.get()] = formula.log_prior;
  }
  scan_in_parts(model, effects, kAtATime, [&](CandidateScore&& score) {
    if (!std::isfinite(score.log_evidence)) return;
    const double log_prior = prior.at(score.effect.get());
    scores.push_back({std::move(score), log_prior});
  });
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
constexpr std::array<Meaning, 26> kMeanings{{
    {"length_by_time_step", "an encoder that lost its place, or a cable that slipped"},
    {"tension_by_time_step", "load cells that were overloaded or knocked"},
    {"roll_by_time_step", "an attitude sensor that was knocked"},
    {"pitch_by_time_step", "an attitude sensor that was knocked"},
    {"yaw_by_time_step", "a yaw that was set anew, or a sensor that was knocked"},
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

bool scatters(const DiagnosisModel& model) {
  return std::ranges::any_of(kTargets, [&](const Target& channel) {
    return is_read(model, channel.channel) && scatters(model, at_rest(channel.channel));
  });
}

namespace {

std::vector<Formula> formulas_of(const DiagnosisModel& model, const AllVisited& visited) {
  Writer writer(model, visited);
  const auto may = [&](const Target& channel, std::size_t c) {
    return visited[c].varies() && (channel.per_cable || !kCovariates[c].per_cable);
  };
  const bool any = scatters(model);
  for (const Target& channel : kTargets) {
    if (!is_read(model, channel.channel)) continue;
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

}  // namespace

std::vector<Formula> formula_candidates(const DiagnosisModel& model) {
  return formulas_of(model, visited_by(model));
}

std::vector<LikelyFormula> likely_formulas(const DiagnosisModel& model, std::size_t count) {
  if (balances_in_motion(model)) return {};
  std::vector<LikelyFormula> likely;
  std::set<std::string> kinds;
  const AllVisited visited = visited_by(model);
  for (LikelyFormula& found : scan_all(model, formulas_of(model, visited))) {
    if (likely.size() == count) break;
    const bool is_new = kinds.insert(without_digits(found.score.effect->name())).second;
    if (is_new) likely.push_back(std::move(found));
  }
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
    meaning = printed("a drum of %.3g mm radius that runs out by %.2g mm", 1e3 * period_m / kTurn,
                      1e3 * out_m);
  }
  definition.sentence = definition.adds.front().to + " += " + definition.adds.front().formula +
                        (meaning.empty() ? "" : ": may be " + meaning);
  return text_effect(definition, Trust::ours);
}

}  // namespace cdprcal

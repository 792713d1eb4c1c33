// How samples come: the noise, holds, filters and steps that were put into them are found, and a
// mean is worth what means really scatter by.
#include "cdprcal/readings/signal.hpp"

#include <gtest/gtest.h>

#include <random>

#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal::test {
namespace {

/// Rests of equal length, one after another, each at a level of its own; what is done to the noise
/// on them is the test's.
struct Rests {
  int rests = 12, rows = 60, cables = 4;
  double rate_Hz = 50.0, sigma = 1.0;
  unsigned seed = 1;
  std::normal_distribution<double> normal;

  /// Readings of one rest [rows] with level and noise.
  using Sensor = std::function<Eigen::VectorXd(std::mt19937&, double level, int rows)>;

  [[nodiscard]] Log log(const Sensor& sensor, std::vector<double>* errors = nullptr) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> levels(-1000.0, 1000.0);
    Log out;
    out.source = "made up";
    const int all = rests * rows;
    out.time_s = Eigen::VectorXd::LinSpaced(all, 0.0, (all - 1) / rate_Hz);
    out.length_m.resize(all, cables);
    for (int c = 0; c < cables; ++c) {
      for (int r = 0; r < rests; ++r) {
        const double level = levels(random);
        const Eigen::VectorXd read = sensor(random, level, rows);
        out.length_m.col(c).segment(r * rows, rows) = read;
        if (errors != nullptr) errors->push_back(read.mean() - level);
      }
    }
    return out;
  }
  [[nodiscard]] std::vector<Equilibrium> equilibria() const {
    std::vector<Equilibrium> out;
    for (int r = 0; r < rests; ++r) {
      out.push_back(
          {{r * rows, (r + 1) * rows}, r * rows / rate_Hz, ((r + 1) * rows - 1) / rate_Hz});
    }
    return out;
  }
  /// Of the lengths; what is filtered is one motion away from chance once in a thousand logs.
  [[nodiscard]] Signal found(const Sensor& sensor, std::vector<double>* errors = nullptr) {
    const Log made = log(sensor, errors);
    return signals(made, {0, made.sample_count()}, equilibria(), load_robot("irma4").sigma)[0];
  }
};

Eigen::VectorXd white(std::mt19937& random, double level, int rows, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  return Eigen::VectorXd::NullaryExpr(rows, [&] { return level + normal(random); });
}

/// Noise of σ after a first-order filter with this correlation from one reading to the next.
Eigen::VectorXd filtered(std::mt19937& random, double level, int rows, double sigma,
                         double correlation) {
  const double fresh = sigma * std::sqrt(1.0 - correlation * correlation);
  Eigen::VectorXd out = white(random, 0.0, rows, fresh);
  out[0] *= sigma / fresh;
  for (int i = 1; i < rows; ++i) out[i] += correlation * out[i - 1];
  return out.array() + level;
}

Eigen::VectorXd held(const Eigen::VectorXd& fresh, int rows, int hold) {
  return Eigen::VectorXd::NullaryExpr(rows, [&](Eigen::Index i) { return fresh[i / hold]; });
}

Eigen::VectorXd rounded(const Eigen::VectorXd& values, double step) {
  return step * (values / step).array().round();
}

/// Means of rests scatter by what the signal says that they do.
void expect_worth(const Signal& signal, const std::vector<double>& errors, int rows,
                  double within) {
  double sum = 0.0;
  for (const double e : errors) sum += e * e;
  const double scatter = std::sqrt(sum / static_cast<double>(errors.size()));
  EXPECT_NEAR(std::sqrt(signal.variance(rows)) / scatter, 1.0, within)
      << signal.sigma << " " << signal.rounding << " " << signal.rows << " "
      << signal.correlation_s;
}

TEST(Signal, OfWhiteNoiseIsWhatItWasBefore) {
  int filtered = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Rests rests;
    rests.seed = seed;
    rests.rows = 30 + 10 * static_cast<int>(seed % 5);
    rests.rate_Hz = seed % 2 == 0 ? 10.0 : 100.0;
    const auto sensor = [](std::mt19937& r, double level, int rows) {
      return white(r, level, rows, 0.3);
    };
    const Signal signal = rests.found(sensor);
    EXPECT_EQ(signal.resolution, 0.0);
    EXPECT_EQ(signal.rounding, 0.0);
    EXPECT_EQ(signal.hold_rows, 1.0);
    if (!signal.is_white()) {
      ++filtered;
      continue;
    }
    const Log log = rests.log(sensor);
    std::vector<double> noise;
    for (int c = 0; c < rests.cables; ++c) noise.push_back(channel_noise(log.length_m.col(c)));
    std::sort(noise.begin(), noise.end());
    EXPECT_EQ(signal.sigma, noise[2]);
    EXPECT_EQ(signal.effective(40), 40.0);
  }
  EXPECT_LE(filtered, 1);  // chance: one in a thousand
}

TEST(Signal, OfAHeldSensorCountsWhatWasRead) {
  for (const int hold : {2, 3, 5, 10}) {
    for (const double rate_Hz : {20.0, 100.0}) {
      Rests rests;
      rests.seed = static_cast<unsigned>(hold);
      rests.rows = 40 * hold;
      rests.rests = 40;
      rests.rate_Hz = rate_Hz;
      std::vector<double> errors;
      const Signal signal =
          rests.found([&](std::mt19937& r, double level,
                          int rows) { return held(white(r, level, rows / hold, 0.3), rows, hold); },
                      &errors);
      EXPECT_EQ(signal.hold_rows, hold);
      EXPECT_NEAR(signal.sigma, 0.3, 0.045);  // jumps between the rests add to it
      EXPECT_NEAR(signal.effective(rests.rows), 40.0, 1e-9);
      EXPECT_EQ(signal.effective(1), 1.0);
      expect_worth(signal, errors, rests.rows, 0.25);
    }
  }
}

TEST(Signal, OfASensorThatLeavesRowsEmptyCountsWhatWasRead) {
  constexpr int kEvery = 4;
  for (const bool in_turn : {false, true}) {  // cables read in rows of their own
    Rests rests;
    rests.rows = 40 * kEvery;
    rests.rests = 40;
    int column = 0;
    std::vector<double> errors;
    Log log = rests.log(
        [](std::mt19937& r, double level, int rows) { return white(r, level, rows, 0.3); });
    for (Eigen::Index row = 0; row < log.sample_count(); ++row) {
      for (column = 0; column < rests.cables; ++column) {
        if (row % kEvery != (in_turn ? column : 0)) log.length_m(row, column) = kNaN;
      }
    }
    const Signal signal =
        signals(log, {0, log.sample_count()}, rests.equilibria(), load_robot("irma4").sigma)[0];
    EXPECT_EQ(signal.hold_rows, kEvery) << in_turn;
    EXPECT_NEAR(signal.sigma, 0.3, 0.03);
    EXPECT_NEAR(signal.effective(rests.rows), 40.0, 1e-9);
    EXPECT_NEAR(signal.period_s, kEvery / rests.rate_Hz, 1e-3);
  }
}

TEST(Signal, OfAFilterMayHaveBegunWithARawReading) {
  constexpr double kCorrelation = 0.5;
  Signal signal;
  signal.sigma = 0.3;
  signal.period_s = 0.1;
  signal.correlation_s = -signal.period_s / std::log(kCorrelation);
  signal.rows = (1.0 + kCorrelation) / (1.0 - kCorrelation);
  // The first reading is what the filter began with: its variance is that of a raw one.
  EXPECT_NEAR(signal.variance(1.0, 0.0), signal.rows * signal.variance(1.0), 1e-12);
  EXPECT_NEAR(signal.variance(1.0, 0.1) - signal.variance(1.0), 0.25 * (signal.rows - 1.0) * 0.09,
              1e-12);
  EXPECT_NEAR(signal.variance(1.0, 100.0), signal.variance(1.0), 1e-12);
  // Of a mean over the first readings it is in as many as it takes to fade: 1 + ½ + ¼ of three.
  const double share = (1.0 + 0.5 + 0.25) / 3.0;
  EXPECT_NEAR(signal.variance(3.0, 0.1) - signal.variance(3.0),
              share * share * (signal.rows - 1.0) * 0.09, 1e-12);
  Signal plain;
  plain.sigma = 0.3;
  EXPECT_EQ(plain.variance(4.0, 0.0), plain.variance(4.0));
}

TEST(Signal, AFilterThatNoChannelShowsByItselfIsFoundInAllOfThem) {
  constexpr double kCorrelation = 0.3;
  const SensorSigma sigma = load_robot("irma4").sigma;
  int alone = 0, together = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Rests rests;
    rests.seed = seed;
    rests.rests = 4;
    rests.rows = 40;
    const auto sensor = [&](std::mt19937& r, double level, int rows) {
      return filtered(r, level, rows, 0.3, kCorrelation);
    };
    Log log = rests.log(sensor);
    const auto found = [&] {
      return signals(log, {0, log.sample_count()}, rests.equilibria(), sigma)[0].correlation_s;
    };
    if (found() > 0.0) ++alone;
    rests.seed += 100;
    log.tension_N = rests.log(sensor).length_m;
    rests.seed += 100;
    log.swivel_rad = 1e-4 * rests.log(sensor).length_m;
    if (found() > 0.0) ++together;
  }
  EXPECT_LE(alone, 8);
  EXPECT_GE(together, 14);
}

TEST(Signal, OfAFilterHasItsTimeConstant) {
  for (const double rate_Hz : {25.0, 50.0, 100.0}) {
    for (const double tau_s : {0.03, 0.05, 0.1}) {
      Rests rests;
      rests.seed = static_cast<unsigned>(rate_Hz + 1e3 * tau_s);
      rests.rate_Hz = rate_Hz;
      rests.rows = static_cast<int>(5.0 * rate_Hz);
      rests.rests = 80;
      std::vector<double> errors;
      const double correlation = std::exp(-1.0 / (rate_Hz * tau_s));
      const Signal signal =
          rests.found([&](std::mt19937& r, double level,
                          int rows) { return filtered(r, level, rows, 0.3, correlation); },
                      &errors);
      EXPECT_NEAR(signal.correlation_s / tau_s, 1.0, 0.25) << rate_Hz << " " << tau_s;
      EXPECT_NEAR(signal.sigma, 0.3, 0.04);
      EXPECT_LT(signal.effective(rests.rows), rests.rows);
      expect_worth(signal, errors, rests.rows, 0.3);
    }
  }
}

/// Within what the sensor is specified for.
constexpr double kNoise_m = 5e-3;

/// White noise behind so many filters of the first order, which had long begun.
Eigen::VectorXd behind_filters(std::mt19937& random, double level, int rows, int order,
                               double correlation) {
  constexpr int kBegun = 300;
  Eigen::VectorXd out = white(random, 0.0, rows + kBegun, kNoise_m);
  for (int k = 0; k < order; ++k) {
    for (Eigen::Index i = 1; i < out.size(); ++i) {
      out[i] = correlation * out[i - 1] + (1.0 - correlation) * out[i];
    }
  }
  return out.tail(rows).array() + level;
}

/// The mean of the last readings, as many as `width`.
Eigen::VectorXd moving_mean(std::mt19937& random, double level, int rows, int width) {
  const Eigen::VectorXd noise = white(random, level, rows + width - 1, kNoise_m);
  return Eigen::VectorXd::NullaryExpr(
      rows, [&](Eigen::Index i) { return noise.segment(i, width).mean(); });
}

/// Readings every so many rows, straight lines between them, and a little white noise on top.
Eigen::VectorXd interpolated(std::mt19937& random, double level, int rows, int every) {
  const Eigen::VectorXd slow = white(random, level, rows / every + 2, kNoise_m);
  const Eigen::VectorXd fast = white(random, 0.0, rows, 0.2 * kNoise_m);
  return Eigen::VectorXd::NullaryExpr(rows, [&](Eigen::Index i) {
    const double along = static_cast<double>(i % every) / every;
    return (1.0 - along) * slow[i / every] + along * slow[i / every + 1] + fast[i];
  });
}

TEST(Signal, OfAnyOtherLowPassIsWorthWhatMeansScatterBy) {
  const std::vector<std::pair<std::string, Rests::Sensor>> sensors{
      {"second order, quick",
       [](auto& r, double l, int n) { return behind_filters(r, l, n, 2, 0.5); }},
      {"second order, slow",
       [](auto& r, double l, int n) { return behind_filters(r, l, n, 2, 0.9); }},
      {"fourth order", [](auto& r, double l, int n) { return behind_filters(r, l, n, 4, 0.7); }},
      {"moving mean", [](auto& r, double l, int n) { return moving_mean(r, l, n, 10); }},
      {"moving mean, long", [](auto& r, double l, int n) { return moving_mean(r, l, n, 40); }},
      {"interpolated", [](auto& r, double l, int n) { return interpolated(r, l, n, 10); }},
  };
  for (const auto& [name, sensor] : sensors) {
    for (const unsigned seed : {1U, 2U, 3U}) {
      SCOPED_TRACE(name + " " + std::to_string(seed));
      Rests rests;
      rests.seed = seed;
      rests.rests = 16;
      rests.rate_Hz = 100.0;
      rests.rows = 500;
      std::vector<double> errors;
      const Signal signal = rests.found(sensor, &errors);
      EXPECT_GT(signal.correlation_s, 0.0);
      expect_worth(signal, errors, rests.rows, 0.4);
    }
  }
}

TEST(Signal, OfRoundedReadingsKeepsWhatAMeanDoesNotAverageOut) {
  constexpr double kStep = 0.5;
  for (const double sigma : {0.0, 0.1, 0.2, 0.3, 0.5, 1.0}) {
    Rests rests;
    rests.rests = 60;
    rests.rows = 80;
    rests.seed = 7;
    std::vector<double> errors;
    const Signal signal =
        rests.found([&](std::mt19937& r, double level,
                        int rows) { return rounded(white(r, level, rows, sigma * kStep), kStep); },
                    &errors);
    EXPECT_NEAR(signal.resolution, sigma > 0.0 ? kStep : signal.resolution, 1e-9) << sigma;
    if (sigma > 0.0) {
      EXPECT_NEAR(signal.sigma / kStep, std::sqrt(sigma * sigma + 1.0 / 12.0), 0.06) << sigma;
      expect_worth(signal, errors, rests.rows, 0.3);
    }
    EXPECT_LE(signal.rounding, kStep / std::sqrt(12.0) * (1.0 + 1e-9));
  }
}

TEST(Signal, OfAHeldRoundedFilterIsAllOfThese) {
  Rests rests;
  rests.rests = 40;
  rests.rows = 300;
  rests.rate_Hz = 100.0;
  std::vector<double> errors;
  const Signal signal = rests.found(
      [](std::mt19937& r, double level, int rows) {
        return held(rounded(filtered(r, level, rows / 2, 0.3, 0.7), 0.4), rows, 2);
      },
      &errors);
  EXPECT_EQ(signal.hold_rows, 2.0);
  EXPECT_NEAR(signal.resolution, 0.4, 1e-9);
  EXPECT_GT(signal.correlation_s, 0.02);
  expect_worth(signal, errors, rests.rows, 0.35);
}

TEST(Signal, OfAPlatformThatSwingsOrCreepsIsNotFiltered) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    for (const double swing_Hz : {0.5, 1.0, 2.0}) {
      Rests rests;
      rests.seed = seed;
      rests.rate_Hz = 20.0;
      rests.rows = 100;
      const Signal signal = rests.found([&](std::mt19937& r, double level, int rows) {
        Eigen::VectorXd out = white(r, level, rows, 0.1);
        for (int i = 0; i < rows; ++i) {
          const double t = i / rests.rate_Hz;
          out[i] += 0.3 * std::sin(2.0 * kPi * swing_Hz * t) + 2.0 * std::exp(-t);
        }
        return out;
      });
      EXPECT_EQ(signal.correlation_s, 0.0) << seed << " " << swing_Hz;
    }
  }
}

TEST(Signal, OfAPlatformThatSwingsInSeveralModesIsNotFiltered) {
  // Lightly damped, each mode in another size and phase at each rest.
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 modes(seed);
    std::uniform_real_distribution<double> frequency_Hz(0.4, 3.0);
    const std::array<double, 3> swings_Hz{frequency_Hz(modes), frequency_Hz(modes),
                                          frequency_Hz(modes)};
    Rests rests;
    rests.seed = seed;
    rests.rate_Hz = seed % 2 == 0 ? 100.0 : 20.0;
    rests.rows = static_cast<int>(5.0 * rests.rate_Hz);
    const std::size_t count = 1 + seed % 3;
    const Signal signal = rests.found([&](std::mt19937& r, double level, int rows) {
      Eigen::VectorXd out = white(r, level, rows, 0.1 * kNoise_m);
      std::uniform_real_distribution<double> phases(0.0, 2.0 * kPi);
      for (std::size_t m = 0; m < count; ++m) {
        const double size = white(r, 0.0, 1, kNoise_m)[0], phase = phases(r);
        for (int i = 0; i < rows; ++i) {
          const double t = i / rests.rate_Hz;
          out[i] += size * std::exp(-0.05 * t) * std::sin(2.0 * kPi * swings_Hz[m] * t + phase);
        }
      }
      return out;
    });
    EXPECT_EQ(signal.correlation_s, 0.0) << seed << " " << count;
  }
}

TEST(Signal, OfTwoLogsIsTheirMeanByWeight) {
  Signals a{}, b{};
  a[0] = {.sigma = 3.0, .rounding = 1.0, .rows = 2.0, .resolution = 0.1, .hold_rows = 2.0};
  b[0] = {.sigma = 4.0, .rows = 4.0, .hold_rows = 4.0, .correlation_s = 0.2};
  const Signal both = mixed(a, 1.0, b, 3.0)[0];
  EXPECT_DOUBLE_EQ(both.sigma, std::sqrt((9.0 + 3.0 * 16.0) / 4.0));
  EXPECT_DOUBLE_EQ(both.rounding, 0.5);
  EXPECT_DOUBLE_EQ(both.rows, 3.5);
  EXPECT_DOUBLE_EQ(both.resolution, 0.1);
  EXPECT_DOUBLE_EQ(both.correlation_s, 0.15);
  EXPECT_EQ(mixed(a, 0.0, b, 1.0)[0].rows, 4.0);
}

TEST(Signal, OfOneColumnHasItsOwnNoiseWhereNothingElseIsKnown) {
  EXPECT_EQ(of_column({.sigma = 2.0}, 0.5).sigma, 0.5);
  EXPECT_EQ(of_column({.sigma = 2.0, .rows = 5.0}, 0.5).sigma, 2.0);
  EXPECT_EQ(of_column({.sigma = 2.0, .rows = 5.0}, 3.0).sigma, 3.0);
}

}  // namespace
}  // namespace cdprcal::test

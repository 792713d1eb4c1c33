#include "cdprcal/readings/signal.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/rest_list.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// A filter is believed in when chance alone shows one so seldom, and no longer when what only a
/// swing does is shown by chance so seldom. Where all channels together show one, what is likely
/// in a channel by itself is enough there: they come through one logger.
constexpr double kChance = 1e-3, kDoubt = 0.05;

/// Variance of the logarithm of two lags' ratio, for white noise: this over the number of rows.
constexpr double kSpread = 4.67;

/// The fresh readings of one channel, column by column, angles unwrapped, and the rests in them.
struct Series {
  struct Column {
    Eigen::VectorXd readings;
    std::vector<SampleRange> rests;
  };
  std::vector<Column> columns;
  double noise = 0.0;       ///< as channel_noise has it, the middle one of the columns'
  double resolution = 0.0;  ///< of the readings, the middle one
  double hold_rows = 1.0;   ///< of the log, a reading
  double period_s = 0.0;    ///< between two readings
  double loudest = 0.0;     ///< noise of the column that has most
  double repeats = 1.0;     ///< of the readings at rest, of the column that repeats itself most
  Channel channel{};
};

/// The share of readings at a rest that are the same to the last digit as those before, at the one
/// where they are most; of few, what it may be. Where that is every other one, a reading between
/// two steps may stay for ever.
double repeats_of(const Series::Column& column) {
  double most = 0.0;
  for (const SampleRange& rest : column.rests) {
    double again = 1.0, all = 2.0;
    for (Eigen::Index i = rest.begin + 1; i < rest.end; ++i) {
      again += column.readings[i] == column.readings[i - 1] ? 1.0 : 0.0;
      all += 1.0;
    }
    if (all > 2.0) most = std::max(most, again / all);
  }
  return most > 0.0 && most < 0.5 ? most : 1.0;
}

/// The step that all steps are multiples of; 0 where it is far below the noise, or there is none.
double resolution_of(const Eigen::VectorXd& values, double noise) {
  constexpr double kShows = 0.5;    // of the noise: finer steps do not change it
  constexpr double kMultiple = 16;  // beyond it the digits that a log has would blur
  constexpr double kOff = 0.05, kMostOff = 0.02;
  constexpr int kFewest = 10;
  std::vector<double> steps;
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    if (!(step > 1e-12 * (1.0 + std::abs(values[i])))) continue;
    if (step < kShows * noise) return 0.0;
    steps.push_back(step);
    least = std::min(least, step);
  }
  if (steps.empty()) return 0.0;
  double sum = 0.0, count = 0.0, off = 0.0, looked_at = 0.0;
  for (const double step : steps) {
    const double times = step / least;
    if (times > kMultiple) continue;
    sum += step, count += std::round(times), ++looked_at;
    if (std::abs(times - std::round(times)) > kOff) ++off;
  }
  return looked_at < kFewest || off > kMostOff * looked_at ? 0.0 : sum / count;
}

/// Variance, over where between two steps a value is, of the mean of its rounded readings.
double kept_by_rounding(double sigma, double step) {
  double sum = 0.0;
  for (double k = 1.0; k < 100.0; ++k) {
    const double exponent = std::pow(2.0 * kPi * k * sigma / step, 2);
    if (exponent > 30.0) break;
    sum += std::exp(-exponent) / (k * k);
  }
  const double all = kPi * kPi / 6.0;  // of 1/k²: q²/12
  return step * step / 12.0 * std::min(1.0, sum / all);
}

/// Noise before rounding, by the variance `white` from one rounded reading to another.
double before_rounding(double white, double step) {
  double low = 0.0, high = std::sqrt(white);
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    const double shown = middle * middle + step * step / 12.0 - kept_by_rounding(middle, step);
    (shown > white ? high : low) = middle;
  }
  return low;
}

/// Mean square of the second differences over `lag` rows at rest, in units of white noise's.
struct Differences {
  double square = kNaN, count = 0.0;
};
Differences differences(const Series& series, Eigen::Index lag) {
  constexpr Eigen::Index kFewest = 8;  // of a rest
  constexpr double kMost = 4.0;        // times the middle one: a spike is not the noise
  std::vector<double> squares, counts;
  for (const auto& [column, rests] : series.columns) {
    for (const SampleRange& rest : rests) {
      const Eigen::Index size = rest.size() - 2 * lag;
      if (size < kFewest) continue;
      const auto at = [&](Eigen::Index shift) { return column.segment(rest.begin + shift, size); };
      const Eigen::ArrayXd second = at(0) - 2.0 * at(lag) + at(2 * lag);
      const double square = second.square().mean() / 6.0;
      if (!std::isfinite(square)) continue;
      squares.push_back(square);
      counts.push_back(static_cast<double>(size));
    }
  }
  Differences out;
  if (squares.empty()) return out;
  // A reading at the edge of a step may be on either side of it, at one rest of many.
  const double edge = 0.25 * series.resolution * series.resolution;
  const double most = std::max(kMost * median(squares), edge);
  double sum = 0.0;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    sum += counts[i] * std::min(squares[i], most);
    out.count += counts[i];
  }
  out.square = sum / out.count;
  return out;
}

/// By how much the squares of a first-order filter grow from one lag to twice that, for a
/// correlation over the first.
double growth(double correlation) {
  return (1.0 + correlation) * (3.0 - correlation * correlation) / (3.0 - correlation);
}
double correlation_for(double grown) {
  double low = 0.0, high = 1.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (growth(middle) > grown ? high : low) = middle;
  }
  return low;
}

/// Whether all channels together look filtered, none of which may do so by itself.
bool look_filtered(const std::vector<Series>& all) {
  double sum = 0.0, count = 0.0;
  for (const Series& series : all) {
    if (series.resolution > 0.0) continue;  // rounding adds to the differences over one row
    if (row_of(series.channel).of().is_inertial()) continue;
    const Differences once = differences(series, 1), twice = differences(series, 2);
    if (!(once.square > 0.0) || !(twice.square > 0.0)) continue;
    sum += twice.count * std::log(twice.square / once.square);
    count += twice.count;
  }
  return sum > normal_quantile(1.0 - kChance) * std::sqrt(kSpread * count);
}

/// Correlation of one reading with the next, where the noise looks filtered; otherwise 0. `at`: the
/// differences over one row; `rounded`: what rounding adds, anew in every reading; `likely`: what
/// chance may show as seldom as in `kDoubt` is believed.
double correlation_of(const Series& series, Differences at, double rounded, bool likely) {
  // Growth near 2 says nothing of a correlation: that over twice the lag is asked for then.
  constexpr double kTelling = 0.5;
  constexpr double kDrowned = 1.5;  // times what rounding adds: less is not told from it
  const double chance = normal_quantile(1.0 - kChance), doubt = normal_quantile(1.0 - kDoubt);
  Differences twice = differences(series, 2);
  if (!(at.square > kDrowned * rounded)) return 0.0;
  for (Eigen::Index lag = 1;; lag *= 2) {
    const double grown = (twice.square - rounded) / (at.square - rounded);
    const double spread = std::sqrt(kSpread / twice.count), error = chance * spread;
    if (!(std::log(grown) > (likely ? doubt * spread : error))) return 0.0;
    if (std::log(grown / growth(1.0)) > error) return 0.0;  // no filter of the first order
    const Differences next = differences(series, 4 * lag);
    if (!(next.count > 0.0)) return 0.0;  // rests too short to tell it from a motion
    if (grown > growth(kTelling)) {
      at = twice, twice = next;
      continue;
    }
    const double correlation = correlation_for(grown);
    const double more = (next.square - rounded) / (twice.square - rounded);
    const double off = doubt * std::sqrt(kSpread / next.count);
    const double less_new = std::sqrt((1.0 + correlation) / (1.0 - correlation));
    if (std::log(more / grown) > off * less_new) return 0.0;  // a motion
    if (std::log(more) < -off) return 0.0;                    // a swing
    return std::pow(correlation, 1.0 / static_cast<double>(lag));
  }
}

/// Noise that a filter has coloured: its variance, and its correlation from one reading to the next
/// or, where the filter is of another order than the first, that of a first one worth as much.
struct Coloured {
  double square, correlation;
};

/// How many readings are worth one whose second differences over `lags` are `squares`, and over the
/// last of these what no correlation is left in: by γ(l) = ¾ (γ(0) − D(l)) + ¼ γ(2l), from long
/// lags to short ones.
double remembered(const std::vector<double>& lags, const std::vector<double>& squares,
                  double settled) {
  std::vector<double> left(lags.size(), 0.0);
  double rows = 0.0;
  for (std::size_t k = lags.size() - 1; k-- > 0;) {
    const auto twice = static_cast<std::size_t>(
        std::lower_bound(lags.begin(), lags.end(), 2.0 * lags[k]) - lags.begin());
    const double later = twice < lags.size() ? left[twice] : 0.0;
    left[k] = 0.75 * (1.0 - squares[k] / settled) + 0.25 * later;
    rows += (lags[k + 1] - lags[k]) * (left[k] + left[k + 1]);
  }
  return rows + lags.front() * (1.0 + left.front());  // from no lag at all
}

/// What a filter of any order leaves of noise settles: over some lag and all up to four times that,
/// second differences are as large as noise makes them that is forgotten, while those of a motion
/// grow and those of a swing come and go. Nothing where none settle, or what settles is more than a
/// sensor's noise may be.
std::optional<Coloured> settled(const Series& series, double rounded, double most_square) {
  constexpr double kStep = 0.25;    // octaves
  constexpr double kRange = 4.0;    // times the lag
  constexpr double kSteady = 0.15;  // of the logarithms of what settles
  constexpr double kFewest = 10.0;  // such lags that the rests hold
  std::vector<double> lags, squares, counts;
  double octave = 0.0;
  bool more = true;
  // As far as it takes: white noise has settled at once.
  const auto go_beyond = [&](double most) {
    while (more && (lags.empty() || lags.back() <= most)) {
      const double lag = std::round(std::exp2(octave));
      octave += kStep;
      if (!lags.empty() && lag == lags.back()) continue;
      const Differences d = differences(series, static_cast<Eigen::Index>(lag));
      more = d.count > kFewest * lag;
      if (!more) return;
      lags.push_back(lag);
      squares.push_back(d.square - rounded);
      counts.push_back(d.count);
    }
  };
  go_beyond(0.0);
  for (std::size_t i = 0; i < lags.size(); ++i) {
    const double most = kRange * lags[i] * (1.0 + 1e-9);
    go_beyond(most);
    std::vector<double> logs;
    std::size_t end = i;
    while (end < lags.size() && lags[end] <= most) logs.push_back(std::log(squares[end++]));
    if (logs.size() < 3 || !(lags[end - 1] > 0.8 * kRange * lags[i])) return std::nullopt;
    const Eigen::Map<const Eigen::ArrayXd> all(logs.data(), static_cast<Eigen::Index>(logs.size()));
    const double mean = all.mean();
    if (!(std::sqrt((all - mean).square().mean()) < kSteady)) continue;
    const double square = std::exp(mean), error = std::sqrt(kSpread * lags[i] / counts[i]);
    const bool grew = std::log(square / squares.front()) > normal_quantile(1.0 - kChance) * error;
    if (!grew || !(square < most_square)) return std::nullopt;
    lags.resize(i + 1);
    const double rows = remembered(lags, squares, square);
    if (!(rows > 1.0)) return std::nullopt;
    return Coloured{square, (rows - 1.0) / (rows + 1.0)};
  }
  return std::nullopt;
}

/// The signal of a channel. `filtered`: that is likely; `most`: what its noise may be.
Signal describe(const Series& series, bool filtered, double most) {
  Signal out;
  out.sigma = series.noise;
  out.rows = out.hold_rows = series.hold_rows;
  out.period_s = series.period_s;
  out.loudest = series.noise > 0.0 ? std::max(1.0, series.loudest / series.noise) : 1.0;
  out.repeats = series.repeats;
  out.resolution = series.resolution;
  const Differences at_rest = differences(series, 1);
  double square = series.noise * series.noise, rounded = 0.0, kept = 0.0;
  if (out.resolution > 0.0) {
    const double all = out.resolution * out.resolution / 12.0;
    // Without rests: what channel_noise says, unless that is the resolution itself.
    const double white = at_rest.count > 0.0 ? at_rest.square : square > 1.01 * all ? square : 0.0;
    const double before = before_rounding(white, out.resolution);
    kept = kept_by_rounding(before, out.resolution);
    rounded = all - kept;
    square = before * before;
  }
  std::optional<Coloured> filter;
  if (const double c = correlation_of(series, at_rest, rounded, filtered); c > 0.0) {
    filter = {3.0 * (at_rest.square - rounded) / ((1.0 - c) * (3.0 - c)), c};
  } else {
    filter = settled(series, rounded, most * most);
  }
  if (filter) {
    square = filter->square;
    out.correlation_s = -series.period_s / std::log(filter->correlation);
    if (out.resolution > 0.0) {
      kept = kept_by_rounding(std::sqrt(square), out.resolution);
      rounded = out.resolution * out.resolution / 12.0 - kept;
    }
    const double worth = square * (1.0 + filter->correlation) / (1.0 - filter->correlation);
    out.rows *= (rounded + worth) / (rounded + square);
  }
  if (out.resolution > 0.0 || filter) {
    out.rounding = std::sqrt(kept);
    out.sigma = std::sqrt(square + rounded + kept);
  }
  return out;
}

/// Of some rows those that have a reading in a column.
std::vector<Eigen::Index> rows_read(const LogMatrix& values, Eigen::Index column,
                                    std::vector<Eigen::Index> rows) {
  std::erase_if(rows, [&](Eigen::Index row) { return !std::isfinite(values(row, column)); });
  return rows;
}

/// Rests by their place among the fresh rows.
std::vector<SampleRange> among(const std::vector<Eigen::Index>& rows,
                               const std::vector<SampleRange>& rests) {
  std::vector<SampleRange> out;
  const auto place = [&](Eigen::Index row) {
    return std::lower_bound(rows.begin(), rows.end(), row) - rows.begin();
  };
  for (const SampleRange& rest : rests) out.push_back({place(rest.begin), place(rest.end)});
  return out;
}

/// Of the columns of one channel; nothing where they show no noise.
std::optional<Series> series_of(const ChannelRow& row, const LogMatrix& values,
                                const FreshRows& fresh, const std::vector<SampleRange>& rests,
                                double period_s) {
  constexpr std::size_t kFewest = 3;  // readings that show any noise
  const bool angles = row.of().is_angle();
  Series out;
  out.channel = channel_of(row);
  std::vector<double> noise, steps;
  double rows = 0.0;
  const Eigen::Index end = std::min<Eigen::Index>(row.first + row.count, values.cols());
  for (Eigen::Index c = row.first; c < end; ++c) {
    const std::vector<Eigen::Index> read = rows_read(values, c, fresh.rows);
    if (read.size() < kFewest) continue;
    Eigen::VectorXd column = values.col(c)(read);
    if (angles) column = unwrapped(std::move(column));
    noise.push_back(channel_noise(column));
    out.columns.push_back({std::move(column), among(read, rests)});
    // A cell that is empty now and then holds no other reading.
    rows += fresh.hold_rows *
            std::round(static_cast<double>(fresh.rows.size()) / static_cast<double>(read.size()));
  }
  if (noise.empty()) return std::nullopt;
  out.noise = median(noise);
  out.loudest = *std::ranges::max_element(noise);
  for (const Series::Column& c : out.columns) {
    steps.push_back(resolution_of(c.readings, out.noise));
  }
  out.resolution = median(steps);
  out.repeats = 0.0;
  for (const Series::Column& c : out.columns) out.repeats = std::max(out.repeats, repeats_of(c));
  out.hold_rows = rows / static_cast<double>(noise.size());
  out.period_s = period_s * out.hold_rows;
  return out;
}

/// Of all channels that the log has.
std::vector<Series> all_series(const Log& log, const SampleRange& run,
                               const std::vector<SampleRange>& rests) {
  const double periods = std::max(1.0, static_cast<double>(run.size() - 1));
  const double period_s =
      run.size() > 0 ? (log.time_s[run.end - 1] - log.time_s[run.begin]) / periods : 0.0;
  std::vector<Series> out;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& values) {
        const FreshRows fresh = fresh_rows(values, run);
        for (const ChannelRow& row : channels_of(sensor)) {
          std::optional<Series> series = series_of(row, values, fresh, rests, period_s);
          if (series) out.push_back(std::move(*series));
        }
      },
      log);
  return out;
}

}  // namespace

double Signal::effective(double samples) const { return std::max(1.0, samples / rows); }

/// Of the mean: how much of it is the reading that a filter may have begun with.
double Signal::share_of_first(double samples, double run_time_s) const {
  const double fresh = std::max(1.0, samples / hold_rows);
  const double since_s = run_time_s - 0.5 * (fresh - 1.0) * period_s;  // of the mean's first
  const double kept = std::exp(-period_s / correlation_s);
  return std::exp(-std::max(0.0, since_s) / correlation_s) * (1.0 - std::pow(kept, fresh)) /
         (fresh * (1.0 - kept));
}

double Signal::variance(double samples, double run_time_s) const {
  const double kept = rounding * rounding;
  double readings = 1.0 / effective(samples);
  if (correlation_s > 0.0) {
    const double raw = rows / hold_rows;  // variance of a reading before the filter
    readings += (raw - 1.0) * std::pow(share_of_first(samples, run_time_s), 2);
  }
  return kept + (sigma * sigma - kept) * readings;
}

Signals signals(const Log& log, const SampleRange& run, const std::vector<Equilibrium>& rests,
                const SensorSigma& sigma, double window_s) {
  std::vector<SampleRange> inner;
  for (const Equilibrium& rest : rests) inner.push_back(inner_part(log, run, rest, window_s));
  return signals_within(log, run, inner, sigma);
}

Signals signals_within(const Log& log, const SampleRange& run,
                       const std::vector<SampleRange>& rests, const SensorSigma& sigma) {
  Signals out;
  if (is_rest_list(log)) return out;  // what a reading scatters by no neighbour tells
  for (std::size_t c = 0; c < kChannels; ++c) out[c].sigma = sigma.*kChannelTable[c].of().sigma;
  const std::vector<Series> all = all_series(log, run, rests);
  const bool filtered = look_filtered(all);
  for (const Series& series : all) {
    Signal& signal = out[static_cast<std::size_t>(series.channel)];
    signal = describe(series, filtered, signal.sigma);
  }
  return out;
}

Signals mixed(const Signals& a, double weight_a, const Signals& b, double weight_b) {
  const double sum = weight_a + weight_b;
  const auto mean = [&](double x, double y) { return (weight_a * x + weight_b * y) / sum; };
  const auto rms = [&](double x, double y) { return std::sqrt(mean(x * x, y * y)); };
  Signals out;
  for (std::size_t c = 0; c < kChannels; ++c) {
    out[c].sigma = rms(a[c].sigma, b[c].sigma);
    out[c].rounding = rms(a[c].rounding, b[c].rounding);
    out[c].rows = mean(a[c].rows, b[c].rows);
    out[c].hold_rows = mean(a[c].hold_rows, b[c].hold_rows);
    out[c].resolution = std::max(a[c].resolution, b[c].resolution);
    out[c].correlation_s = mean(a[c].correlation_s, b[c].correlation_s);
    out[c].period_s = mean(a[c].period_s, b[c].period_s);
    out[c].loudest = std::max(a[c].loudest, b[c].loudest);
    out[c].repeats = std::max(a[c].repeats, b[c].repeats);
  }
  return out;
}

Signal of_column(Signal channel, double noise) {
  channel.sigma = channel.is_white() ? noise : std::max(noise, channel.sigma);
  return channel;
}

}  // namespace cdprcal

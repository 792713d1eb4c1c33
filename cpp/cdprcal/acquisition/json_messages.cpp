#include "cdprcal/acquisition/json_messages.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>

namespace cdprcal {
namespace {

constexpr std::size_t kRecordHeader = 9;    // opcode, size of the content
constexpr std::size_t kMessageHeader = 22;  // channel, sequence, log time, publish time
constexpr char kMessage = 5;
constexpr std::size_t kMostKeys = 64;  // of all messages; a log has 48 columns at most

template <class T>
T little_endian(const char* at) {
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value = static_cast<T>(value | static_cast<T>(static_cast<unsigned char>(at[i])) << (8 * i));
  }
  return value;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Rows as they are read; the number of keys may grow.
class Reader {
 public:
  /// False: not plain.
  bool add(std::string_view text) {
    at_ = text.data();
    end_ = at_ + text.size();
    row_.assign(row_.size(), kNaN);
    there_.assign(there_.size(), 0);
    next_key_ = 0;
    skip_blanks();
    if (!take('{')) return false;
    skip_blanks();
    if (!take('}')) {
      do {
        if (!member()) return false;
      } while (take(','));
      if (!take('}')) return false;
    }
    skip_blanks();
    if (at_ != end_) return false;
    rows_.push_back(row_.size());
    values_.insert(values_.end(), row_.begin(), row_.end());
    present_.insert(present_.end(), there_.begin(), there_.end());
    return true;
  }

  JsonMessages finish() && {
    JsonMessages out;
    const auto rows = static_cast<Eigen::Index>(rows_.size());
    const auto keys = static_cast<Eigen::Index>(names_.size());
    out.values.setConstant(rows, keys, kNaN);
    out.present.setConstant(rows, keys, false);
    std::size_t from = 0;
    for (Eigen::Index row = 0; row < rows; ++row) {
      const std::size_t width = rows_[static_cast<std::size_t>(row)];
      for (std::size_t k = 0; k < width; ++k, ++from) {
        out.values(row, static_cast<Eigen::Index>(k)) = values_[from];
        out.present(row, static_cast<Eigen::Index>(k)) = present_[from] != 0;
      }
    }
    out.names = std::move(names_);
    return out;
  }

 private:
  void skip_blanks() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\n' || *at_ == '\r')) ++at_;
  }

  bool take(char wanted) {
    if (at_ == end_ || *at_ != wanted) return false;
    ++at_;
    return true;
  }

  bool member() {
    skip_blanks();
    std::size_t key = 0;
    if (!take('"') || !read_key(key)) return false;
    if (there_[key] != 0) return false;  // twice
    there_[key] = 1;
    skip_blanks();
    if (!take(':')) return false;
    skip_blanks();
    if (!number(row_[key]) && !null()) return false;
    skip_blanks();
    return true;
  }

  /// The key up to its closing quote. Most often it is the one after the last.
  bool read_key(std::size_t& key) {
    const auto left = static_cast<std::size_t>(end_ - at_);
    if (next_key_ < names_.size()) {
      const std::string& guess = names_[next_key_];
      if (left > guess.size() && at_[guess.size()] == '"' &&
          std::memcmp(at_, guess.data(), guess.size()) == 0) {
        key = next_key_++;
        at_ += guess.size() + 1;
        return true;
      }
    }
    const char* stop = at_;
    while (stop != end_ && *stop != '"') {
      // Escapes and anything that is not ASCII: no column is called so.
      const auto byte = static_cast<unsigned char>(*stop);
      if (byte == '\\' || byte < 0x20 || byte >= 0x80) return false;
      ++stop;
    }
    if (stop == end_) return false;
    const std::string_view name(at_, static_cast<std::size_t>(stop - at_));
    at_ = stop + 1;
    key = static_cast<std::size_t>(std::find(names_.begin(), names_.end(), name) - names_.begin());
    if (key == names_.size()) {
      if (key == kMostKeys) return false;
      names_.emplace_back(name);
      row_.push_back(kNaN);
      there_.push_back(0);
    }
    next_key_ = key + 1;
    return true;
  }

  /// A number by JSON's grammar, which is narrower than that of from_chars.
  bool number(double& value) {
    const char* digits = at_;
    if (digits != end_ && *digits == '-') ++digits;
    if (digits == end_ || !is_digit(*digits)) return false;
    if (*digits == '0' && digits + 1 != end_ && is_digit(digits[1])) return false;
    const auto [stop, status] = std::from_chars(at_, end_, value);
    if (status != std::errc{}) return false;
    const char* const point = std::find(digits, stop, '.');
    if (point != stop && (point + 1 == stop || !is_digit(point[1]))) return false;
    const auto is_real = [](char c) { return c == '.' || c == 'e' || c == 'E'; };
    if (value == 0.0 && std::none_of(at_, stop, is_real)) value = 0.0;  // the whole number -0 is 0
    at_ = stop;
    return true;
  }

  bool null() {
    if (end_ - at_ < 4 || std::memcmp(at_, "null", 4) != 0) return false;
    at_ += 4;
    return true;
  }

  const char* at_ = nullptr;
  const char* end_ = nullptr;
  std::vector<std::string> names_;
  std::size_t next_key_ = 0;
  std::vector<double> row_, values_;
  std::vector<char> there_, present_;  // parallel to row_ and values_
  std::vector<std::size_t> rows_;      // how many keys were known at each
};

}  // namespace

std::optional<JsonMessages> plain_json_messages(std::string_view records,
                                                std::span<const std::uint16_t> channels) {
  Reader reader;
  std::int64_t count = 0;
  for (; !records.empty(); ++count) {
    if (records.size() < kRecordHeader || records.front() != kMessage) return std::nullopt;
    const auto size = little_endian<std::uint64_t>(records.data() + 1);
    records.remove_prefix(kRecordHeader);
    if (size < kMessageHeader || size > records.size()) return std::nullopt;
    const auto channel = little_endian<std::uint16_t>(records.data());
    const std::string_view text = records.substr(kMessageHeader, size - kMessageHeader);
    if (std::find(channels.begin(), channels.end(), channel) != channels.end() &&
        !reader.add(text)) {
      return std::nullopt;
    }
    records.remove_prefix(size);
  }
  JsonMessages read = std::move(reader).finish();
  read.messages = count;
  return read;
}

}  // namespace cdprcal

#include "cdprcal/readings/json_messages.hpp"

#include <simdjson.h>

#include <algorithm>

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

/// Rows as they are read; the number of keys may grow.
class Reader {
 public:
  /// False: not plain.
  bool add(std::string_view text) {
    simdjson::dom::object object;
    if (parser_.parse(text.data(), text.size()).get_object().get(object) != simdjson::SUCCESS) {
      return false;
    }
    row_.assign(row_.size(), kNaN);
    there_.assign(there_.size(), 0);
    next_key_ = 0;
    for (const auto& [name, value] : object) {
      const std::optional<std::size_t> key = key_of(name);
      if (!key || there_[*key] != 0) return false;
      there_[*key] = 1;
      if (!value.is_null() && value.get_double().get(row_[*key]) != simdjson::SUCCESS) return false;
    }
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
  /// Most often it is the one after the last.
  std::optional<std::size_t> key_of(std::string_view name) {
    std::size_t key = next_key_;
    if (key >= names_.size() || names_[key] != name) {
      key =
          static_cast<std::size_t>(std::find(names_.begin(), names_.end(), name) - names_.begin());
    }
    if (key == names_.size()) {
      if (key == kMostKeys) return std::nullopt;
      names_.emplace_back(name);
      row_.push_back(kNaN);
      there_.push_back(0);
    }
    next_key_ = key + 1;
    return key;
  }

  simdjson::dom::parser parser_;
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

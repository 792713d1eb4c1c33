// Flat JSON messages inside of MCAP records, read into columns at the speed of the disk. What is
// not plain is left to a reader of one message at a time, which can say what is wrong with it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// The members of many JSON objects, a row an object.
struct JsonMessages {
  using Flags = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::int64_t messages = 0;       ///< those that were passed over too
  std::vector<std::string> names;  ///< [K] keys, in the order in which they appear first
  LogMatrix values;                ///< [N, K] NaN for null and for a key that is absent
  Flags present;                   ///< [N, K] whether the object has the key
};

/// The messages on `channels` in `records`, which are the inside of one MCAP chunk: opcode, size,
/// content, one after the other (https://mcap.dev/spec). Messages on other channels are passed
/// over. Nothing unless every record is a whole message and every one of these is an object of
/// numbers and nulls by the grammar of JSON (RFC 8259), no key twice, no number beyond double
/// precision, no whole number beyond 64 bits.
std::optional<JsonMessages> plain_json_messages(std::string_view records,
                                                std::span<const std::uint16_t> channels);

}  // namespace cdprcal

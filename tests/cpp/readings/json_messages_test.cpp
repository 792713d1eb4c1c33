#include "cdprcal/readings/json_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace cdprcal {
namespace {

using Channels = std::vector<std::uint16_t>;

template <class T>
std::string bytes_of(T value) {
  std::string out;
  for (std::size_t i = 0; i < sizeof(T); ++i) out += static_cast<char>(value >> (8 * i) & 0xFF);
  return out;
}

std::string message(const std::string& text, std::uint16_t channel = 7) {
  const std::string head = bytes_of(channel) + bytes_of<std::uint32_t>(1) +
                           bytes_of<std::uint64_t>(2) + bytes_of<std::uint64_t>(3);
  return '\x05' + bytes_of<std::uint64_t>(head.size() + text.size()) + head + text;
}

TEST(JsonMessages, RowsOfMessagesAndColumnsOfKeys) {
  const auto read = plain_json_messages(
      message(R"({"time_s": 0.5, "a": -1e-3, "b":null})") + message("no JSON at all", 3) +
          message("\n{ \"b\" : 4 ,\t\"time_s\":1 } ") + message("{}") +
          message(R"({"c":2,"time_s":1.25e1,"a":-0})"),
      Channels{7});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->names, (std::vector<std::string>{"time_s", "a", "b", "c"}));
  EXPECT_EQ(read->messages, 5);
  ASSERT_EQ(read->values.rows(), 4);
  const auto there = [&](int row) {
    std::string said;
    for (int k = 0; k < 4; ++k) said += read->present(row, k) ? 'x' : '.';
    return said;
  };
  EXPECT_EQ(there(0), "xxx.");
  EXPECT_EQ(there(1), "x.x.");
  EXPECT_EQ(there(2), "....");
  EXPECT_EQ(there(3), "xx.x");
  EXPECT_EQ(read->values(0, 1), -1e-3);
  EXPECT_TRUE(std::isnan(read->values(0, 2)));
  EXPECT_EQ(read->values(1, 2), 4.0);
  EXPECT_TRUE(read->values.row(2).array().isNaN().all());
  EXPECT_EQ(read->values(3, 0), 12.5);
  EXPECT_FALSE(std::signbit(read->values(3, 1)));  // a whole number has no -0
}

TEST(JsonMessages, KeysMayHaveEscapesAndNumbersMayVanish) {
  const auto read = plain_json_messages(
      message(R"({"a\u0062":1e-999,"\u00e4":18446744073709551615})"), Channels{7});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->names, (std::vector<std::string>{"ab", "\xC3\xA4"}));
  EXPECT_EQ(read->values(0, 0), 0.0);
  EXPECT_EQ(read->values(0, 1), 18446744073709551616.0);
}

TEST(JsonMessages, NothingIsNothing) {
  const auto read = plain_json_messages("", Channels{7});
  ASSERT_TRUE(read);
  EXPECT_EQ(read->values.rows(), 0);
}

TEST(JsonMessages, WhatIsNotPlainIsLeft) {
  for (const char* text : {"",
                           "1",
                           "[]",
                           "{",
                           "{}x",
                           R"({"a"})",
                           R"({"a":})",
                           R"({"a":1,})",
                           R"({,"a":1})",
                           R"({"a":1 "b":2})",
                           R"({"a":1,"a":2})",
                           R"({"a":"1"})",
                           R"({"a":true})",
                           R"({"a":nul)",
                           R"({"a":{}})",
                           R"({"a\u006":1})",
                           "{\"a\xC3\":1}",
                           "{\"a\tb\":1}",
                           R"({a:1})",
                           R"({"a":+1})",
                           R"({"a":01})",
                           R"({"a":-01})",
                           R"({"a":.5})",
                           R"({"a":1.})",
                           R"({"a":1.e5})",
                           R"({"a":1e})",
                           R"({"a":1e999})",
                           R"({"a":18446744073709551616})",
                           R"({"a":NaN})",
                           R"({"a":-})",
                           R"({"a":inf})",
                           R"({"a":0x10})"}) {
    EXPECT_FALSE(plain_json_messages(message(text), Channels{7})) << text;
    EXPECT_TRUE(plain_json_messages(message(text, 8), Channels{7})) << text;
  }
}

TEST(JsonMessages, RecordsMustBeWholeMessages) {
  const std::string whole = message(R"({"a":1})");
  for (std::size_t size = 1; size < whole.size(); ++size) {
    EXPECT_FALSE(plain_json_messages(whole.substr(0, size), Channels{7})) << size;
  }
  EXPECT_FALSE(plain_json_messages('\x04' + whole.substr(1), Channels{7}));
  // A content that is shorter than a message's head, and one that is longer than the chunk.
  EXPECT_FALSE(plain_json_messages('\x05' + bytes_of<std::uint64_t>(21) + whole, Channels{7}));
  EXPECT_FALSE(plain_json_messages('\x05' + bytes_of<std::uint64_t>(~0ULL) + whole, Channels{7}));
}

TEST(JsonMessages, KeysAreBounded) {
  std::string text = "{";
  for (int i = 0; i < 64; ++i) text += (i > 0 ? ",\"k" : "\"k") + std::to_string(i) + "\":1";
  EXPECT_TRUE(plain_json_messages(message(text + "}"), Channels{7}));
  EXPECT_FALSE(plain_json_messages(message(text + ",\"one\":2}"), Channels{7}));
}

}  // namespace
}  // namespace cdprcal

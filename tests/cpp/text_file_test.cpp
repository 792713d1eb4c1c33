// Whole text files, and how messages quote them.
#include "cdprcal/text_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

TEST(TextFile, ComesBackByteForByteAndNoLongerThanAsked) {
  const std::string path = ::testing::TempDir() + "cdprcal_text_file";
  const std::string text = std::string("a\r\n\0b", 5) + std::string(200'000, 'x');
  write_text_file(path, text);
  EXPECT_EQ(read_text_file(path), text);
  EXPECT_EQ(read_text_file(path, 4), text.substr(0, 4));
  EXPECT_EQ(read_text_file(path, 100'000), text.substr(0, 100'000));
  std::filesystem::remove(path);
}

TEST(TextFile, WhatCannotBeOpenedIsNamed) {
  EXPECT_THROW(read_text_file("absent.txt"), InputError);
  EXPECT_THROW(read_text_file(::testing::TempDir()), InputError);
  EXPECT_THROW(write_text_file("absent/file.txt", ""), InputError);
  EXPECT_THROW(write_text_file("/dev/full", std::string(100'000, 'x')), InputError);
}

TEST(InQuotes, IsOneShortLineThatCutsNoCharacter) {
  EXPECT_EQ(in_quotes("abc"), "'abc'");
  EXPECT_EQ(in_quotes("a\nb\x1b[31m\x7f"), "'a b [31m '");
  EXPECT_EQ(in_quotes("a\u009b31mb\u0085c\u2028d\u2029"), "'a 31mb c d '");
  EXPECT_EQ(in_quotes("\u00a0\u00c2\u2027\u202a€\xC2"), "'\u00a0\u00c2\u2027\u202a€\xC2'");
  EXPECT_EQ(in_quotes(std::string(40, 'a')), "'" + std::string(40, 'a') + "'");
  EXPECT_EQ(in_quotes(std::string(41, 'a')), "'" + std::string(40, 'a') + "…'");
  const std::string head(39, 'a');
  EXPECT_EQ(in_quotes(head + "é"), "'" + head + "…'");
  EXPECT_EQ(in_quotes(head + "éb"), "'" + head + "…'");
  EXPECT_EQ(in_quotes(head + "€uro"), "'" + head + "…'");
  EXPECT_EQ(in_quotes(std::string(37, 'a') + "😀b"), "'" + std::string(37, 'a') + "…'");
  // Bytes that are no UTF-8 are cut somewhere.
  EXPECT_LE(in_quotes(std::string(100, '\x80')).size(), 45U);
}

}  // namespace
}  // namespace cdprcal

// Whole text files, and how messages quote them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>

#include "cdprcal/error.hpp"
#include "cdprcal/text.hpp"
#include "cdprcal/text_file.hpp"
#include "support/refusal.hpp"

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

/// What reading a path is refused with.
std::string refusal(const std::string& path) {
  return test::refusal_of([&] { read_text_file(path); });
}

TEST(TextFile, ThatIsNoneSaysWhatItIs) {
  // A pipe, a device or a socket might never end: each is refused before a byte is read.
  const std::string folder = ::testing::TempDir() + "cdprcal_no_text_file";
  std::filesystem::create_directories(folder);
  EXPECT_EQ(refusal(folder), folder + ": is a folder; give the path of a file");
  const std::string pipe = folder + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(refusal(pipe), pipe + ": is a pipe: save what comes out of it to a file first");
  const std::string socket_path = folder + "/socket";
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(socket_path.size(), sizeof address.sun_path);
  std::memcpy(address.sun_path, socket_path.c_str(), socket_path.size());
  const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(refusal(socket_path), socket_path + ": is a socket; give the path of a file");
  close(listener);
  EXPECT_EQ(refusal("/dev/zero"), "/dev/zero: is a device; give the path of a file");
  EXPECT_EQ(refusal(folder + "/absent"), folder +
                                             "/absent: cannot be opened: No such file or directory"
                                             "; check the path and its permissions");
  std::filesystem::remove_all(folder);
}

TEST(TextFile, WhoseDiskFailsIsNotTakenForAShortOne) {
  // Nothing is mapped at address 0, so that the first read of this file is an input/output error.
  const std::string failing = "/proc/self/mem";
  if (!std::filesystem::exists(failing)) GTEST_SKIP() << "no " << failing << " on this system";
  EXPECT_EQ(refusal(failing), failing + ": cannot be read; look at the disk");
}

TEST(TextFile, ThatCannotBeWrittenIsNamed) {
  EXPECT_THAT([] { write_text_file("absent/file.txt", ""); },
              ::testing::ThrowsMessage<InputError>(
                  "absent/file.txt: cannot be created; check the path and its permissions"));
  // Both what the stream writes at once and what it keeps until it is closed.
  for (const std::size_t size : {std::size_t{10}, std::size_t{100'000}}) {
    EXPECT_THAT([&] { write_text_file("/dev/full", std::string(size, 'x')); },
                ::testing::ThrowsMessage<InputError>(
                    "/dev/full: could not be written to its end; free some space"));
  }
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

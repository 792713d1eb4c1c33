#include "cdprcal/text.hpp"

#include <array>
#include <charconv>

namespace cdprcal {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

std::string shortest(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

void add_item(std::string& list, std::string_view item, std::string_view between) {
  if (!list.empty()) list += between;
  list += item;
}

std::string one_line(std::string text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
  };
  std::size_t end = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    // In UTF-8: U+0080 to U+009F, which terminals obey too; U+2028 and U+2029, which end a line.
    const bool high = byte(i) == 0xC2 && byte(i + 1) >= 0x80 && byte(i + 1) <= 0x9F;
    const bool line_end =
        byte(i) == 0xE2 && byte(i + 1) == 0x80 && (byte(i + 2) == 0xA8 || byte(i + 2) == 0xA9);
    const bool control = byte(i) < 0x20 || byte(i) == 0x7F || high || line_end;
    text[end++] = control ? ' ' : text[i];
    i += high ? 1 : line_end ? 2 : 0;
  }
  text.resize(end);
  return text;
}

std::string shown(std::string_view text) {
  constexpr std::size_t longest = 40;
  const bool cut = text.size() > longest;
  if (cut) {
    std::size_t end = longest;
    // Continuation bytes are 10xxxxxx; a character has three of them at most.
    while (end > longest - 3 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
    text = text.substr(0, end);
  }
  return one_line(std::string(text)) + (cut ? "…" : "");
}

std::string in_quotes(std::string_view text) { return "'" + shown(text) + "'"; }

}  // namespace cdprcal

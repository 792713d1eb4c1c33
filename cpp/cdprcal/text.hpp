// Numbers, lists and quotations as messages and files have them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

namespace cdprcal {

/// By a pattern of printf.
std::string printed(const char* pattern, auto... values) {
  std::string out(
      static_cast<std::size_t>(std::max(0, std::snprintf(nullptr, 0, pattern, values...))), '\0');
  std::snprintf(out.data(), out.size() + 1, pattern, values...);
  return out;
}

/// Without blanks, tabs and carriage returns at either end.
std::string_view trimmed(std::string_view text);

/// The shortest decimal that reads back as the same number.
std::string shortest(double value);

/// Adds an item to a list in words, with what parts it from those before.
void add_item(std::string& list, std::string_view item, std::string_view between = ", ");

/// The same text with a blank for every control character and line end, Unicode's (in UTF-8) among
/// them.
std::string one_line(std::string text);
/// Text of a file as a message may show it: on one line, without control characters, at most 40
/// bytes and "…". No UTF-8 character is cut in two.
std::string shown(std::string_view text);
/// The same between quotation marks: 'text'.
std::string in_quotes(std::string_view text);

}  // namespace cdprcal

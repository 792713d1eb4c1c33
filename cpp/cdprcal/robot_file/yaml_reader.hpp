// Private to robot_file/: strict reading of a YAML document, every error with its place.
//
// A YamlField is one value with its path ("platform.mass_kg") and its line; a YamlMapping is a
// field whose keys were checked against the keys that its reader knows. yaml-cpp itself accepts
// unknown and duplicate keys.
#pragma once

#include <yaml-cpp/yaml.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cdprcal/types.hpp"

namespace cdprcal::detail {

/// Larger texts are refused: no robot file needs this, and a mistaken file may be huge.
inline constexpr std::size_t kMostYamlBytes = 250'000;

/// Text between quotation marks, as YAML reads it back.
std::string double_quoted(const std::string& text);

/// A field of a YAML document.
class YamlField {
 public:
  /// Parses a whole document; throws InputError when it is empty, too large (over 250 kB), binary,
  /// nested too deeply, not YAML, or more than one document.
  static YamlField parse_document(const std::string& text, const std::string& source);

  [[nodiscard]] double number() const;     ///< finite
  [[nodiscard]] std::string text() const;  ///< any scalar but null
  [[nodiscard]] std::vector<double> numbers(std::size_t count) const;
  [[nodiscard]] Vector3 vector3() const;
  [[nodiscard]] Vector3 direction() const;          ///< a vector that is not zero
  [[nodiscard]] Vector3 number_or_vector3() const;  ///< one number stands for all three
  [[nodiscard]] Matrix3 matrix3() const;            ///< a list of three rows of three
  /// Numbers in nested lists, one after the other: shape {} is one number, {4, 3} four lists of
  /// three.
  [[nodiscard]] std::vector<double> numbers(const std::vector<int>& shape) const;
  /// The scalar at a key of this mapping before its keys are checked, if there is one.
  [[nodiscard]] std::optional<YamlField> peek(const std::string& key) const;
  /// Keys, as they come, and values of a mapping whose keys anybody chooses.
  [[nodiscard]] std::vector<std::pair<std::string, YamlField>> entries() const;
  /// Items of a list; item i is called "path[#i+1]".
  [[nodiscard]] std::vector<YamlField> items() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Throws InputError "source:line:column: path: problem".
  [[noreturn]] void fail(const std::string& problem) const;
  /// The same for a field of this document by path; at the nearest enclosing field that was read.
  /// `offset`: at which character of its text, from 0.
  [[noreturn]] void fail_at(const std::string& path, const std::string& problem,
                            std::optional<std::size_t> offset = std::nullopt) const;

 private:
  friend class YamlMapping;
  /// What all fields of a document share: its name, and where each field that was read stands.
  struct Document {
    std::string source;
    std::map<std::string, YAML::Mark> marks;
    std::vector<std::string> lines;
  };
  YamlField(std::shared_ptr<Document> document, std::string path, const YAML::Node& node,
            const YAML::Mark& mark);
  /// How many characters of a text's place are not its own: 1 for a quotation mark; nothing where
  /// it is folded over lines.
  [[nodiscard]] std::optional<int> opening(const YAML::Mark& mark) const;
  /// `node` as the field `key` of this one, at the node's own place.
  [[nodiscard]] YamlField at(const YAML::Node& node, const std::string& key) const;

  std::shared_ptr<Document> document_;
  std::string path_;
  YAML::Node node_;
  YAML::Mark mark_;
};

/// A field that is a mapping; construction refuses unknown, duplicate and non-text keys.
class YamlMapping {
 public:
  YamlMapping(YamlField field, const std::vector<std::string>& known_keys);

  /// The value of a key; InputError when it is missing.
  [[nodiscard]] YamlField require(const std::string& key) const;
  [[nodiscard]] std::optional<YamlField> find(const std::string& key) const;
  [[nodiscard]] double number_or(const std::string& key, double fallback) const;
  /// Which of some words it is; the first where the key is missing.
  [[nodiscard]] std::size_t word_or(const std::string& key,
                                    const std::vector<std::string>& words) const;

 private:
  YamlField field_;
  std::map<std::string, std::pair<YAML::Node, YAML::Node>> values_;  ///< key node and value
};

}  // namespace cdprcal::detail

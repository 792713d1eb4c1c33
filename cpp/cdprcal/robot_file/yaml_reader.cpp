#include "cdprcal/robot_file/yaml_reader.hpp"

#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <boost/nowide/utf/utf.hpp>
#include <charconv>
#include <numeric>
#include <sstream>

#include "cdprcal/error.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal::detail {
namespace {

std::string place(const std::string& source, const YAML::Mark& mark) {
  if (mark.is_null()) return source + ": ";
  return source + ":" + std::to_string(mark.line + 1) + ":" + std::to_string(mark.column + 1) +
         ": ";
}

/// YAML is UTF-8; its reader would take a name in Latin-1, whose bytes no JSON can hold.
void refuse_unless_text(const std::string& text, const std::string& source) {
  namespace utf = boost::nowide::utf;
  if (text.size() > kMostYamlBytes) {
    throw InputError(source + ": is over 250 kB: this is not a robot file; give one");
  }
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    throw InputError(source + ":1: is UTF-16 text; save it as UTF-8");
  }
  const auto at = [&](std::ptrdiff_t offset) {
    const auto line = 1 + std::count(text.begin(), text.begin() + offset, '\n');
    return source + ":" + std::to_string(line) + ": ";
  };
  const auto is_control = [](char c) {
    return static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\r' && c != '\t';
  };
  const auto control = std::find_if(text.begin(), text.end(), is_control);
  if (control != text.end()) {
    throw InputError(at(control - text.begin()) +
                     "holds control characters: this is a binary file; give a robot file");
  }
  for (auto next = text.begin(); next != text.end();) {
    const auto begin = next;
    const utf::code_point c = utf::utf_traits<char>::decode(next, text.end());
    if (c == utf::illegal || c == utf::incomplete) {
      throw InputError(at(begin - text.begin()) + "is not UTF-8 text; save the file as such");
    }
  }
}

/// Levenshtein distance, to suggest the key that was meant.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string known_keys_hint(const std::string& key, const std::vector<std::string>& known) {
  std::string best, all;
  std::size_t best_distance = 1 + std::max<std::size_t>(2, key.size() / 3);  // beyond: another word
  for (const std::string& candidate : known) {
    add_item(all, candidate);
    // Long keys cannot be typing errors, and would make this quadratic in the size of the file.
    std::size_t distance = key.size() > 64 ? best_distance : edit_distance(key, candidate);
    if (candidate.rfind(key + "_", 0) == 0) distance = 0;  // only the unit is missing
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best.empty() ? "; known here: " + all : "; did you mean " + best + "?";
}

/// .inf and .nan of YAML 1.2, which from_chars does not know.
bool is_yaml_infinity(const std::string& scalar) {
  const std::string word = scalar.substr(scalar.find_first_not_of("+-") == 1 ? 1 : 0);
  return word == ".inf" || word == ".Inf" || word == ".INF" || word == ".nan" || word == ".NaN" ||
         word == ".NAN";
}

/// Where documents begin, nothing else.
class DocumentStarts : public YAML::EventHandler {
 public:
  std::vector<YAML::Mark> starts;

  void OnDocumentStart(const YAML::Mark& mark) override { starts.push_back(mark); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// Where a second document begins. Not by YAML::LoadAll: at a bracket that nothing opened it makes
/// empty documents without end.
std::optional<YAML::Mark> second_document(const std::string& text) {
  std::istringstream stream(text);
  YAML::Parser parser(stream);
  DocumentStarts documents;
  for (int i = 0; i < 2 && parser.HandleNextDocument(documents); ++i) {
  }
  if (documents.starts.size() < 2) return std::nullopt;
  return documents.starts[1];
}

const char* kind_of(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Null:
      return "empty";
    case YAML::NodeType::Scalar:
      return "a single value";
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a mapping";
    default:
      return "undefined";
  }
}

}  // namespace

std::string double_quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

YamlField::YamlField(std::shared_ptr<Document> document, std::string path, const YAML::Node& node,
                     const YAML::Mark& mark)
    : document_(std::move(document)), path_(std::move(path)), node_(node), mark_(mark) {
  document_->marks.insert_or_assign(path_, mark_);
}

YamlField YamlField::parse_document(const std::string& text, const std::string& source) {
  refuse_unless_text(text, source);
  auto document = std::make_shared<Document>();
  document->source = source;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) document->lines.push_back(line);
  try {
    if (const std::optional<YAML::Mark> second = second_document(text)) {
      throw InputError(place(source, *second) +
                       "a second document begins here, or a bracket or comma has no beginning; put "
                       "each robot into a file of its own");
    }
    const YAML::Node root = YAML::Load(text);
    if (!root.IsDefined() || root.IsNull()) {
      throw InputError(source +
                       ": is empty; a robot file must start with 'name: …', see cdprcal template");
    }
    return {document, "", root, root.Mark()};
  } catch (const YAML::DeepRecursion& error) {
    throw InputError(place(source, error.mark) +
                     "nested too deeply for a robot file; see cdprcal template");
  } catch (const YAML::Exception& error) {
    throw InputError(place(source, error.mark) + "not YAML: " + one_line(error.msg) +
                     "; see cdprcal template");
  }
}

void YamlField::fail(const std::string& problem) const {
  throw InputError(place(document_->source, mark_) + (path_.empty() ? "" : path_ + ": ") + problem);
}

void YamlField::fail_at(const std::string& path, const std::string& problem,
                        std::optional<std::size_t> offset) const {
  std::string where = document_->source + ": ";
  for (std::string known = path;; known.resize(known.rfind('.'))) {
    const auto found = document_->marks.find(known);
    if (found != document_->marks.end()) {
      YAML::Mark mark = found->second;
      const std::optional<int> opened = offset && known == path ? opening(mark) : std::nullopt;
      if (opened) mark.column += static_cast<int>(*offset) + *opened;
      where = place(document_->source, mark);
      break;
    }
    if (known.rfind('.') == std::string::npos) break;
  }
  throw InputError(where + path + ": " + problem);
}

YamlField YamlField::at(const YAML::Node& node, const std::string& key) const {
  const bool joined = !path_.empty() && !key.empty();
  return {document_, path_ + (joined ? "." : "") + key, node, node.Mark()};
}

double YamlField::number() const {
  if (!node_.IsScalar()) fail(std::string("must be a number, not ") + kind_of(node_));
  const std::string& scalar = node_.Scalar();
  if (node_.Tag() == "!") fail("must be a number, not the text " + in_quotes(scalar));
  const char* begin = scalar.data();
  const char* end = begin + scalar.size();
  if (scalar.size() > 1 && scalar[0] == '+' && scalar[1] != '-') ++begin;
  double value = 0.0;
  const auto [stop, status] = std::from_chars(begin, end, value);
  if (status == std::errc::result_out_of_range)
    fail(in_quotes(scalar) + " is beyond double precision; check the number");
  if (is_yaml_infinity(scalar) || (stop == end && status == std::errc{} && !std::isfinite(value))) {
    fail("must be a finite number, not " + scalar);
  }
  if (status != std::errc{} || stop != end) fail("must be a number, not " + in_quotes(scalar));
  return value;
}

std::string YamlField::text() const {
  if (!node_.IsScalar()) fail(std::string("must be text, not ") + kind_of(node_));
  return node_.Scalar();
}

std::optional<int> YamlField::opening(const YAML::Mark& mark) const {
  const auto line = static_cast<std::size_t>(mark.line);
  const auto column = static_cast<std::size_t>(mark.column);
  if (line >= document_->lines.size() || column >= document_->lines[line].size()) return 0;
  const char c = document_->lines[line][column];
  if (c == '>' || c == '|') return std::nullopt;
  return c == '"' || c == '\'' ? 1 : 0;
}

std::vector<std::pair<std::string, YamlField>> YamlField::entries() const {
  std::vector<std::string> keys;
  if (node_.IsMap()) {
    for (const auto& entry : node_) {
      if (entry.first.IsScalar()) keys.push_back(entry.first.Scalar());
    }
  }
  const YamlMapping map(*this, keys);
  std::vector<std::pair<std::string, YamlField>> out;
  for (const std::string& key : keys) out.emplace_back(key, map.require(key));
  return out;
}

std::vector<YamlField> YamlField::items() const {
  if (!node_.IsSequence()) fail(std::string("must be a list, not ") + kind_of(node_));
  std::vector<YamlField> items;
  items.reserve(node_.size());
  for (const YAML::Node& item : node_) {
    std::string path = path_ + "[#" + std::to_string(items.size() + 1) + "]";
    items.push_back({document_, std::move(path), item, item.Mark()});
  }
  return items;
}

std::vector<double> YamlField::numbers(std::size_t count) const {
  const std::string wanted = "must be a list of " + std::to_string(count) + " numbers";
  if (!node_.IsSequence()) fail(wanted + ", not " + kind_of(node_));
  if (node_.size() != count) fail(wanted + ", but has " + std::to_string(node_.size()));
  std::vector<double> values;
  for (const YamlField& item : items()) values.push_back(item.number());
  return values;
}

std::vector<double> YamlField::numbers(const std::vector<int>& shape) const {
  if (shape.empty()) return {number()};
  if (shape.size() == 1) return numbers(static_cast<std::size_t>(shape[0]));
  const auto count = static_cast<std::size_t>(shape[0]);
  const std::vector<int> inner(shape.begin() + 1, shape.end());
  const std::string wanted = "must be a list of " + std::to_string(count) + " lists of " +
                             std::to_string(inner[0]) + " numbers";
  if (!node_.IsSequence()) fail(wanted + ", not " + kind_of(node_));
  if (node_.size() != count) fail(wanted + ", but has " + std::to_string(node_.size()));
  std::vector<double> values;
  for (const YamlField& item : items()) {
    const std::vector<double> row = item.numbers(inner);
    values.insert(values.end(), row.begin(), row.end());
  }
  return values;
}

std::optional<YamlField> YamlField::peek(const std::string& key) const {
  if (!node_.IsMap()) return std::nullopt;
  for (const auto& entry : node_) {
    const bool here = entry.first.IsScalar() && entry.first.Scalar() == key;
    if (here && entry.second.IsScalar()) return at(entry.second, key);
  }
  return std::nullopt;
}

Vector3 YamlField::vector3() const {
  const std::vector<double> values = numbers(3);
  return {values[0], values[1], values[2]};
}

Vector3 YamlField::direction() const {
  const Vector3 value = vector3();
  if (value.isZero(0.0)) fail("is zero: give a direction in the world, such as [0, 0, -1]");
  return value;
}

Vector3 YamlField::number_or_vector3() const {
  if (node_.IsScalar()) return Vector3::Constant(number());
  return vector3();
}

Matrix3 YamlField::matrix3() const {
  if (!node_.IsSequence() || node_.size() != 3) {
    fail("must be three rows of three numbers, [[…], […], […]]");
  }
  const std::vector<YamlField> rows = items();
  Matrix3 matrix;
  for (int i = 0; i < 3; ++i) matrix.row(i) = rows[static_cast<std::size_t>(i)].vector3();
  return matrix;
}

YamlMapping::YamlMapping(YamlField field, const std::vector<std::string>& known_keys)
    : field_(std::move(field)) {
  if (!field_.node_.IsMap()) {
    field_.fail(std::string("must be a mapping (key: value), not ") + kind_of(field_.node_));
  }
  for (const auto& entry : field_.node_) {
    const YAML::Node& key = entry.first;
    if (!key.IsScalar()) field_.at(key, "").fail("a key must be text");
    const std::string& name = key.Scalar();
    if (std::find(known_keys.begin(), known_keys.end(), name) == known_keys.end()) {
      field_.at(key, shown(name)).fail("unknown key" + known_keys_hint(name, known_keys));
    }
    if (!values_.emplace(name, entry).second) field_.at(key, name).fail("given twice: delete one");
  }
}

std::optional<YamlField> YamlMapping::find(const std::string& key) const {
  const auto found = values_.find(key);
  if (found == values_.end()) return std::nullopt;
  const auto& [key_node, value] = found->second;
  YamlField field = field_.at(value, key);
  // An empty value stands wherever the next token does; its key is the better place.
  if (value.IsNull()) field.mark_ = key_node.Mark();
  return field;
}

YamlField YamlMapping::require(const std::string& key) const {
  if (auto field = find(key)) return *field;
  field_.at(field_.node_, key).fail("is missing: add it");
}

std::size_t YamlMapping::word_or(const std::string& key,
                                 const std::vector<std::string>& words) const {
  const auto field = find(key);
  if (!field) return 0;
  const auto word = std::find(words.begin(), words.end(), field->text());
  if (word != words.end()) return static_cast<std::size_t>(word - words.begin());
  std::string known;
  for (const std::string& one : words) add_item(known, one, " or ");
  field->fail("must be " + known + ", not " + in_quotes(field->text()));
}

double YamlMapping::number_or(const std::string& key, double fallback) const {
  const auto field = find(key);
  return field ? field->number() : fallback;
}

}  // namespace cdprcal::detail

#include "cdprcal/effects/expression.hpp"

#include <algorithm>
#include <array>
#include <boost/spirit/home/x3.hpp>
#include <charconv>
#include <numbers>

#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

namespace x3 = boost::spirit::x3;

constexpr std::size_t kMostCharacters = 400;
constexpr int kMostNested = 24;
constexpr std::size_t kMostHeld = 16;  ///< numbers that wait for others

/// One function, for numbers and for numbers with derivatives. Operators are functions too; their
/// names cannot be written.
struct Function {
  const char* name;
  std::size_t arguments;
  double (*of_numbers)(const double*);
  Slope (*of_slopes)(const Slope*);
};

template <class F>
constexpr Function one(const char* name, F) {
  return {name, 1, [](const double* x) -> double { return F{}(x[0]); },
          [](const Slope* x) -> Slope { return F{}(x[0]); }};
}

template <class F>
constexpr Function two(const char* name, F) {
  return {name, 2, [](const double* x) -> double { return F{}(x[0], x[1]); },
          [](const Slope* x) -> Slope { return F{}(x[0], x[1]); }};
}

double value_of(double x) { return x; }
double value_of(const Slope& x) { return x.a; }

using std::abs, std::acos, std::asin, std::atan, std::atan2, std::cos, std::cosh, std::exp,
    std::expm1, std::floor, std::hypot, std::log, std::log10, std::log1p, std::pow, std::sin,
    std::sinh, std::sqrt, std::tan, std::tanh;

/// A power with a whole number is a product: of negative bases, and of 0, with its derivatives.
template <class T>
T power(const T& base, const T& exponent, bool is_constant) {
  const double n = value_of(exponent);
  constexpr double kMostProducts = 16.0;
  if (!is_constant || n != std::floor(n) || std::abs(n) > kMostProducts) return pow(base, exponent);
  T product(1.0);
  for (int i = 0; i < static_cast<int>(std::abs(n)); ++i) product *= base;
  return n < 0.0 ? T(1.0) / product : product;
}

const std::array<Function, 30> kFunctions{{
    two("+", [](const auto& x, const auto& y) { return x + y; }),
    two("-", [](const auto& x, const auto& y) { return x - y; }),
    two("*", [](const auto& x, const auto& y) { return x * y; }),
    two("/", [](const auto& x, const auto& y) { return x / y; }),
    {"^", 2, [](const double* x) { return power(x[0], x[1], true); },
     [](const Slope* x) { return power(x[0], x[1], x[1].v.isZero(0.0)); }},
    one("negative", [](const auto& x) { return -x; }),
    one("sin", [](const auto& x) { return sin(x); }),
    one("cos", [](const auto& x) { return cos(x); }),
    one("tan", [](const auto& x) { return tan(x); }),
    one("asin", [](const auto& x) { return asin(x); }),
    one("acos", [](const auto& x) { return acos(x); }),
    one("atan", [](const auto& x) { return atan(x); }),
    two("atan2", [](const auto& y, const auto& x) { return atan2(y, x); }),
    one("sinh", [](const auto& x) { return sinh(x); }),
    one("cosh", [](const auto& x) { return cosh(x); }),
    one("tanh", [](const auto& x) { return tanh(x); }),
    one("exp", [](const auto& x) { return exp(x); }),
    one("expm1", [](const auto& x) { return expm1(x); }),
    one("log", [](const auto& x) { return log(x); }),
    one("log10", [](const auto& x) { return log10(x); }),
    one("log1p", [](const auto& x) { return log1p(x); }),
    one("sqrt", [](const auto& x) { return sqrt(x); }),
    one("abs", [](const auto& x) { return abs(x); }),
    two("hypot", [](const auto& x, const auto& y) { return hypot(x, y); }),
    two("min", [](const auto& x, const auto& y) { return value_of(y) < value_of(x) ? y : x; }),
    two("max", [](const auto& x, const auto& y) { return value_of(x) < value_of(y) ? y : x; }),
    // Flat but for their jumps.
    one("sign",
        [](const auto& x) {
          using T = std::decay_t<decltype(x)>;
          return T(value_of(x) > 0.0 ? 1.0 : value_of(x) < 0.0 ? -1.0 : 0.0);
        }),
    one("step",
        [](const auto& x) {
          using T = std::decay_t<decltype(x)>;
          return T(value_of(x) > 0.0 ? 1.0 : 0.0);
        }),
    one("floor",
        [](const auto& x) {
          using T = std::decay_t<decltype(x)>;
          return T(std::floor(value_of(x)));
        }),
    two("rest",  // of a division: the phase of a period
        [](const auto& x, const auto& y) { return x - y * std::floor(value_of(x / y)); }),
}};

std::size_t function_index(std::string_view name) {
  const auto at =
      std::ranges::find_if(kFunctions, [&](const Function& f) { return name == f.name; });
  return static_cast<std::size_t>(at - kFunctions.begin());
}

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) add_item(text, name);
  return text;
}

}  // namespace

/// Takes down what the grammar finds, as the steps of a stack machine.
struct ExpressionWriter {
  const std::string& text;
  const std::vector<std::string>& names;
  Expression& out;
  struct Call {
    std::size_t function, place, arguments;
  };
  std::vector<Call> calls{};
  std::size_t held = 0;  ///< on the stack now

  using Range = boost::iterator_range<std::string::const_iterator>;
  [[nodiscard]] std::size_t place_of(const Range& range) const {
    return static_cast<std::size_t>(range.begin() - text.begin());
  }
  void push(Expression::Step step) {
    out.steps_.push_back(step);
    if (++held > kMostHeld) throw ExpressionError("is nested too deeply; split it", step.place);
  }
  void number(const Range& range) {
    double value = 0.0;
    std::from_chars(&*range.begin(), &*range.begin() + range.size(), value);
    push({Expression::Step::Kind::constant, 0, value, place_of(range)});
  }
  void name(const Range& range) {
    const std::string word(range.begin(), range.end());
    if (word == "pi") {
      return push({Expression::Step::Kind::constant, 0, std::numbers::pi, place_of(range)});
    }
    const auto at = std::ranges::find(names, word);
    if (at == names.end()) {
      throw ExpressionError("knows no " + in_quotes(word) + " here; give one of " + list_of(names),
                            place_of(range));
    }
    push({Expression::Step::Kind::name, static_cast<std::size_t>(at - names.begin()), 0.0,
          place_of(range)});
  }
  void open(const Range& range) {
    const std::string word(range.begin(), range.end());
    const std::size_t function = function_index(word);
    if (function == kFunctions.size()) {
      throw ExpressionError("knows no function " + in_quotes(word) + "; give one of " +
                                list_of(Expression::function_names()),
                            place_of(range));
    }
    calls.push_back({function, place_of(range), 0});
  }
  void argument() { ++calls.back().arguments; }
  void close() {
    const Call call = calls.back();
    calls.pop_back();
    const Function& f = kFunctions[call.function];
    if (call.arguments != f.arguments) {
      throw ExpressionError(std::string(f.name) + " takes " + std::to_string(f.arguments) +
                                " argument(s), not " + std::to_string(call.arguments) +
                                "; correct it",
                            call.place);
    }
    apply(call.function);
  }
  void apply(std::size_t function) {
    held -= kFunctions[function].arguments - 1;
    out.steps_.push_back({Expression::Step::Kind::function, function});
  }
};

namespace {

ExpressionWriter& writer(const auto& context) { return x3::get<ExpressionWriter>(context).get(); }
template <std::size_t function>
const auto kApply = [](const auto& context) { writer(context).apply(function); };
const auto kNumber = [](const auto& c) { writer(c).number(x3::_attr(c)); };
const auto kName = [](const auto& c) { writer(c).name(x3::_attr(c)); };
const auto kOpen = [](const auto& c) { writer(c).open(x3::_attr(c)); };
const auto kArgument = [](const auto& c) { writer(c).argument(); };
const auto kClose = [](const auto& c) { writer(c).close(); };

const x3::rule<class SumRule> sum = "a formula";
const x3::rule<class ProductRule> product = "a term";
const x3::rule<class SignedRule> signed_one = "a number, name or (";
const x3::rule<class PowerRule> power_of = "a number, name or (";

const auto digits = +x3::digit;
const auto number_text = x3::raw[x3::lexeme[((digits >> -('.' >> *x3::digit)) | ('.' >> digits)) >>
                                            -(x3::char_("eE") >> -x3::char_("+-") >> digits)]];
const auto word = x3::raw[x3::lexeme[(x3::alpha | '_') >> *(x3::alnum | '_')]];
const auto call =
    ((word >> &x3::lit('('))[kOpen] >> '(' > -((sum >> x3::eps[kArgument]) % ',') > ')') >>
    x3::eps[kClose];
const auto primary = number_text[kNumber] | call | word[kName] | ('(' > sum > ')');

const auto sum_def = product >> *(('+' > product)[kApply<0>] | ('-' > product)[kApply<1>]);
const auto product_def = signed_one >>
                         *(('*' > signed_one)[kApply<2>] | ('/' > signed_one)[kApply<3>]);
const auto signed_one_def = ('-' > signed_one)[kApply<5>] | ('+' > signed_one) | power_of;
const auto power_of_def = primary >> -(('^' > signed_one)[kApply<4>]);

BOOST_SPIRIT_DEFINE(sum, product, signed_one, power_of)

void check_nesting(const std::string& text) {
  int nested = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    nested += text[i] == '(' ? 1 : text[i] == ')' ? -1 : 0;
    if (nested > kMostNested) throw ExpressionError("is nested too deeply; split it", i);
  }
}

}  // namespace

std::vector<std::string> Expression::function_names() {
  std::vector<std::string> names;
  for (std::size_t i = 6; i < kFunctions.size(); ++i) names.emplace_back(kFunctions[i].name);
  return names;
}

Expression::Expression(const std::string& text, const std::vector<std::string>& names) {
  if (text.size() > kMostCharacters) {
    throw ExpressionError("is longer than 400 characters; split it", kMostCharacters);
  }
  check_nesting(text);
  ExpressionWriter taker{text, names, *this};
  auto at = text.begin();
  const auto wants = [&](auto where, const std::string& wanted) {
    const auto offset = static_cast<std::size_t>(where - text.begin());
    const std::string found =
        where == text.end() ? "the end" : in_quotes(std::string(where, text.end()));
    throw ExpressionError("wants " + wanted + ", not " + found + "; correct it", offset);
  };
  try {
    const bool parsed = x3::phrase_parse(
        at, text.end(), x3::with<ExpressionWriter>(std::ref(taker))[sum], x3::space);
    if (!parsed) wants(at, "a formula");
  } catch (const x3::expectation_failure<std::string::const_iterator>& error) {
    wants(error.where(), error.which());
  }
  if (at != text.end()) wants(at, "an operator or the end");
}

template <class T>
T Expression::run(std::span<const T> values) const {
  std::array<T, kMostHeld> stack;
  std::size_t top = 0;
  for (const Step& step : steps_) {
    switch (step.kind) {
      case Step::Kind::constant:
        stack[top++] = T(step.constant);
        break;
      case Step::Kind::name:
        stack[top++] = values[step.index];
        break;
      case Step::Kind::function: {
        const Function& f = kFunctions[step.index];
        top -= f.arguments;
        if constexpr (std::is_same_v<T, double>) {
          stack[top] = f.of_numbers(&stack[top]);
        } else {
          stack[top] = f.of_slopes(&stack[top]);
        }
        ++top;
      }
    }
  }
  return stack[0];
}

double Expression::operator()(std::span<const double> values) const { return run(values); }
Slope Expression::operator()(std::span<const Slope> values) const { return run(values); }

std::size_t Expression::place_of(std::size_t name) const {
  for (const Step& step : steps_) {
    if (step.kind == Step::Kind::name && step.index == name) return step.place;
  }
  return std::string::npos;
}

}  // namespace cdprcal

#include "cdprcal/workspace/inscribed_box.hpp"

#include <algorithm>

namespace cdprcal {
namespace {

/// Grid points [low, high] on each of three (permuted) axes.
struct Block {
  std::array<int, 3> low{};
  std::array<int, 3> high{};
  double cells = 0.0;  ///< volume in grid cells; 0: none yet
};

/// All maximal rectangles under a histogram (column heights in points), by the stack of rising
/// columns; keeps the best one. A rectangle of w×h points has (w − 1)(h − 1) cells.
template <typename Keep>
void maximal_rectangles(const std::vector<int>& height, std::vector<int>& stack, Keep&& keep) {
  const int columns = static_cast<int>(height.size());
  stack.clear();
  for (int column = 0; column <= columns; ++column) {
    const int current = column < columns ? height[column] : 0;
    while (!stack.empty() && height[stack.back()] >= current) {
      const int top = height[stack.back()];
      stack.pop_back();
      const int first = stack.empty() ? 0 : stack.back() + 1;
      keep(first, column - 1, top);
    }
    stack.push_back(column);
  }
}

}  // namespace

std::optional<Box> largest_inscribed_box(const Workspace& workspace) {
  const Grid& grid = workspace.grid;
  // Pairs of planes along the shortest side (a), histograms over the other two (b rows, c columns).
  std::array<int, 3> axis{2, 1, 0};
  std::stable_sort(axis.begin(), axis.end(),
                   [&](int p, int q) { return grid.count[p] < grid.count[q]; });
  const int na = grid.count[axis[0]];
  const int nb = grid.count[axis[1]];
  const int nc = grid.count[axis[2]];
  const auto inside = [&](int a, int b, int c) {
    std::array<int, 3> ijk{};
    ijk[axis[0]] = a;
    ijk[axis[1]] = b;
    ijk[axis[2]] = c;
    return workspace.status[grid.index(ijk)] == PointStatus::inside;
  };
  Block best;
  std::vector<char> column_inside(static_cast<std::size_t>(nb) * nc);
  std::vector<int> height(nc);
  std::vector<int> stack;
  for (int first = 0; first < na; ++first) {
    std::fill(column_inside.begin(), column_inside.end(), 1);
    for (int last = first; last < na; ++last) {
      bool any = false;
      for (int b = 0; b < nb; ++b) {
        for (int c = 0; c < nc; ++c) {
          char& cell = column_inside[static_cast<std::size_t>(b) * nc + c];
          if (cell != 0 && !inside(last, b, c)) cell = 0;
          any = any || cell != 0;
        }
      }
      if (!any) break;
      // Even the whole plane would not beat what we have.
      const double depth = na == 1 ? 1.0 : last - first;  // flat: any thickness
      if (depth * (nb - 1.0) * (nc - 1.0) <= best.cells) continue;
      std::fill(height.begin(), height.end(), 0);
      for (int b = 0; b < nb; ++b) {
        for (int c = 0; c < nc; ++c) {
          height[c] = column_inside[static_cast<std::size_t>(b) * nc + c] != 0 ? height[c] + 1 : 0;
        }
        maximal_rectangles(height, stack, [&](int c_low, int c_high, int top) {
          const double cells = depth * (c_high - c_low) * (top - 1.0);
          if (cells <= best.cells) return;
          best.cells = cells;
          best.low[axis[0]] = first;
          best.high[axis[0]] = last;
          best.low[axis[1]] = b - top + 1;
          best.high[axis[1]] = b;
          best.low[axis[2]] = c_low;
          best.high[axis[2]] = c_high;
        });
      }
    }
  }
  if (best.cells <= 0.0) return std::nullopt;
  return Box{grid.position_m(best.low), grid.position_m(best.high)};
}

bool box_is_inside(const Workspace& workspace, const Box& box) {
  const Grid& grid = workspace.grid;
  std::array<int, 3> low{};
  std::array<int, 3> high{};
  for (int a = 0; a < 3; ++a) {
    // Grid points strictly around the box, so that nothing of it lies in an untested cell.
    low[a] = static_cast<int>(std::floor((box.lower_m[a] - grid.origin_m[a]) / grid.step_m + 1e-9));
    high[a] = static_cast<int>(std::ceil((box.upper_m[a] - grid.origin_m[a]) / grid.step_m - 1e-9));
    if (low[a] < 0 || high[a] >= grid.count[a] || low[a] > high[a]) return false;
  }
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int i = low[0]; i <= high[0]; ++i) {
        if (workspace.status[grid.index({i, j, k})] != PointStatus::inside) return false;
      }
    }
  }
  return true;
}

}  // namespace cdprcal

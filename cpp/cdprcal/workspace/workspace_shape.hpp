// The boundary of a static workspace as a watertight mesh.
#pragma once

#include <optional>

#include "cdprcal/workspace/alpha_shape.hpp"
#include "cdprcal/workspace/workspace.hpp"

namespace cdprcal {

/// Of a workspace: grid points inside and boundary points. Automatic alpha: at least step² (a grid
/// cell needs ¾ step²), so that full cells are solid; at most (2 · step)², so that hollows wider
/// than four steps stay hollow; the least in between with one piece and no point outside.
/// Points deep inside are left out of the triangulation and their space is solid as it is: the
/// result is the same, sooner.
AlphaShape workspace_shape(const Workspace& workspace,
                           const std::optional<double>& alpha_m2 = std::nullopt);

}  // namespace cdprcal

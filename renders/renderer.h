#pragma once

#include <GL/osmesa.h>
#include <mujoco/mujoco.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "controller/common/types.h"
#include "renders/image.h"
#include "renders/viewpoint.h"

namespace dexcheck {

// Mesa's off-screen OpenGL, loaded when the first context is made: with LLVM in it, it takes 60 ms of
// processor time to load, and most commands draw nothing.

/// The functions that are called here; MuJoCo finds its own.
struct Mesa {
// clang-format off
#define DEXCHECK_MESA(X)                                                                             \
  X(OSMesaCreateContextExt) X(OSMesaDestroyContext) X(OSMesaGetCurrentContext) X(OSMesaMakeCurrent)  \
  X(glBegin) X(glDeleteLists) X(glEnd) X(glEndList) X(glGenLists) X(glNewList) X(glNormal3dv)        \
  X(glNormal3f) X(glVertex3dv) X(glVertex3f)
// clang-format on
// A member's name stands without parentheses. NOLINTNEXTLINE(bugprone-macro-parentheses)
#define DEXCHECK_FUNCTION(name) decltype(&::name) name;
  DEXCHECK_MESA(DEXCHECK_FUNCTION)
#undef DEXCHECK_FUNCTION
};

/// @throws Error when the library is not there.
const Mesa& LoadMesa();

/// An OpenGL context in software that needs neither a display nor a graphics card. It belongs to the thread
/// that makes it. The process must not link EGL: MuJoCo's OpenGL loader would prefer it.
class OffscreenContext {
 public:
  /// Makes the context and makes it current. Drawing happens in the calling thread, one picture of the
  /// process at a time.
  /// @throws Error when the OpenGL library cannot make one.
  OffscreenContext();
  ~OffscreenContext();
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;

  /// Further OpenGL calls of this thread go to this context. @throws Error.
  void MakeCurrent();

 private:
  OSMesaContext context_ = nullptr;
  std::vector<std::uint8_t> buffer_;  // the context's own surface; MuJoCo draws into one of its own
};

/// A camera that stands still where RenderOptions::course says; an MJCF's camera of this name comes first.
inline constexpr const char* kCourseCamera = "course";

// Decorations: shapes drawn into the scene besides the model's own geoms. Points in world coordinates, m.

/// A force or another vector; without a tip a piece of a line.
struct Arrow {
  Vector3d from;
  Vector3d to;
  double radius;  ///< Of the shaft, m.
  Color color;
  bool has_tip = true;
};

/// The forces that Coulomb friction allows: a cone that opens from its apex along its axis.
struct Cone {
  Vector3d apex;
  Vector3d axis;      ///< Unit vector.
  double height;      ///< m.
  double half_angle;  ///< rad, atan(mu).
  Color color;
};

using Decoration = std::variant<Arrow, Cone>;

struct RenderOptions {
  int width = 1280;
  int height = 720;
  std::string camera = "overview";  ///< A camera of the MJCF, or kCourseCamera.
  Viewpoint course;
  int shadow_size = 2048;  ///< Pixels of the shadow map.
  /// Each pixel is the mean of samples x samples (1 to 4). This smooths the edges of geoms,
  /// shadows and textures at the cost of four-fold multisampling in software, which would leave the edges of
  /// shadows jagged.
  int samples = 2;
  /// Moves what cameras of the MJCF see to the right by this fraction of the picture's width, to make room
  /// for a panel.
  double shift_right = 0.0;
  std::string translucent_body;  ///< Its geoms are seen through; none when empty.
};

/// Names of the cameras of a model, in its order.
std::vector<std::string> ListCameras(const mjModel& model);

/// @throws InputError that lists the cameras, unless the model has this one or it is kCourseCamera.
void CheckCamera(const mjModel& model, const std::string& name);

/// Draws states of one model, off screen. Frames depend on their state alone: the same state gives the same
/// bytes. Use it in the thread that made it; several threads may each have one.
class Renderer {
 public:
  /// @param model must outlive the renderer.
  /// @throws InputError when the model has no such camera (the message lists those that exist) or body.
  /// @throws std::invalid_argument for sizes that cannot be drawn.
  Renderer(const mjModel& model, const RenderOptions& options);
  ~Renderer();  // NOLINT(bugprone-exception-escape)

  /// Draws the state in `data`, whose kinematics, cameras and lights must be computed.
  Image Render(mjData& data, std::span<const Decoration> decorations = {});

  /// Draws from a camera at the given viewpoint a picture at most as large as the options' one.
  Image Render(mjData& data, const Viewpoint& from, int width, int height,
               std::span<const Decoration> decorations);

  /// Draws from a camera of the model.
  Image Render(mjData& data, const std::string& camera, int width, int height,
               std::span<const Decoration> decorations = {});

 private:
  Image Draw(mjData& data, mjvCamera view, int width, int height, double shift_right,
             std::span<const Decoration> decorations);
  [[nodiscard]] mjvCamera MakeCamera(int camera) const;
  void FadeBody();

  const mjModel& model_;
  RenderOptions options_;
  int camera_;
  int translucent_body_;
  std::optional<OffscreenContext> gl_;
  mjvOption visible_;
  mjvPerturb perturb_;
  mjvScene scene_;
  mjrContext context_;
  unsigned cone_ = 0;  // display list
  std::vector<std::uint8_t> pixels_;
};

}  // namespace dexcheck

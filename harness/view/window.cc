#include "harness/view/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <map>
#include <utility>

#include "controller/common/errors.h"

namespace dexcheck {
namespace {

// OpenGL 1.0 of the window's own context: what is linked belongs to the off-screen one.
constexpr unsigned kRgb = 0x1907;              // GL_RGB
constexpr unsigned kUnsignedByte = 0x1401;     // GL_UNSIGNED_BYTE
constexpr unsigned kUnpackAlignment = 0x0CF5;  // GL_UNPACK_ALIGNMENT
constexpr unsigned kColorBuffer = 0x4000;      // GL_COLOR_BUFFER_BIT

template <typename Function>
Function Load(const char* name) {
  // The type is what OpenGL says of the name. NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast)
  return reinterpret_cast<Function>(glfwGetProcAddress(name));
}

int NameKey(int key) {
  static const std::map<int, int> names = {{GLFW_KEY_LEFT, kKeyLeft},     {GLFW_KEY_RIGHT, kKeyRight},
                                           {GLFW_KEY_ESCAPE, kKeyEscape}, {GLFW_KEY_BACKSPACE, kKeyBackspace},
                                           {GLFW_KEY_TAB, kKeyTab},       {GLFW_KEY_F1, kKeyF1}};
  const auto name = names.find(key);
  return name == names.end() ? key : name->second;
}

std::string TellError() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown reason";
}

}  // namespace

struct Window::Impl {
  GLFWwindow* window = nullptr;
  std::vector<InputEvent> events;
  // Where the mouse was reported last: queried now, it would be where it is after events that are still to
  // come.
  double cursor_x = 0.0;
  double cursor_y = 0.0;
  int width = 0;  // of the picture
  int height = 0;

  void (*viewport)(int, int, int, int) = nullptr;
  void (*clear)(unsigned) = nullptr;
  void (*raster_pos)(float, float) = nullptr;
  void (*pixel_zoom)(float, float) = nullptr;
  void (*pixel_store)(unsigned, int) = nullptr;
  void (*draw_pixels)(int, int, unsigned, unsigned, const void*) = nullptr;

  static Impl& Of(GLFWwindow* window) { return *static_cast<Impl*>(glfwGetWindowUserPointer(window)); }

  /// Where the picture is in a space of this size, and how much it is enlarged.
  struct Fit {
    double left, top, scale;
  };
  [[nodiscard]] Fit CalcFit(int space_width, int space_height) const {
    const double scale =
        std::min(static_cast<double>(space_width) / width, static_cast<double>(space_height) / height);
    return {0.5 * (space_width - scale * width), 0.5 * (space_height - scale * height), scale};
  }

  InputEvent MakeEvent(InputEvent::Kind kind) const {
    InputEvent event;
    event.kind = kind;
    int window_width = 1;
    int window_height = 1;
    glfwGetWindowSize(window, &window_width, &window_height);
    const Fit fit = CalcFit(std::max(window_width, 1), std::max(window_height, 1));
    event.x = (cursor_x - fit.left) / fit.scale;
    event.y = (cursor_y - fit.top) / fit.scale;
    event.control = glfwGetKey(window, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS ||
                    glfwGetKey(window, GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
    return event;
  }

  void Listen() {
    glfwSetWindowUserPointer(window, this);
    glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int /*mods*/) {
      using enum InputEvent::Button;
      InputEvent event =
          Of(w).MakeEvent(action == GLFW_PRESS ? InputEvent::Kind::kPress : InputEvent::Kind::kRelease);
      event.button = button == GLFW_MOUSE_BUTTON_LEFT    ? kLeft
                     : button == GLFW_MOUSE_BUTTON_RIGHT ? kRight
                                                         : kMiddle;
      Of(w).events.push_back(event);
    });
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
      Of(w).cursor_x = x;
      Of(w).cursor_y = y;
      Of(w).events.push_back(Of(w).MakeEvent(InputEvent::Kind::kMove));
    });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double /*x*/, double y) {
      InputEvent event = Of(w).MakeEvent(InputEvent::Kind::kScroll);
      event.scroll = y;
      Of(w).events.push_back(event);
    });
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int /*scancode*/, int action, int /*mods*/) {
      if (action == GLFW_RELEASE) return;
      InputEvent event = Of(w).MakeEvent(InputEvent::Kind::kKey);
      event.key = NameKey(key);
      Of(w).events.push_back(event);
    });
  }
};

Window::Window(const std::string& title, int width, int height) : impl_(std::make_unique<Impl>()) {
  if (glfwInit() != GLFW_TRUE) throw InputError("view: no window can be opened: " + TellError());
  impl_->width = width;
  impl_->height = height;
  impl_->window = glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr);
  if (impl_->window == nullptr) {
    const std::string error = TellError();
    glfwTerminate();
    throw InputError("view: no window can be opened: " + error);
  }
  impl_->Listen();
  glfwMakeContextCurrent(impl_->window);
  glfwSwapInterval(0);
  impl_->viewport = Load<void (*)(int, int, int, int)>("glViewport");
  impl_->clear = Load<void (*)(unsigned)>("glClear");
  impl_->raster_pos = Load<void (*)(float, float)>("glRasterPos2f");
  impl_->pixel_zoom = Load<void (*)(float, float)>("glPixelZoom");
  impl_->pixel_store = Load<void (*)(unsigned, int)>("glPixelStorei");
  impl_->draw_pixels = Load<void (*)(int, int, unsigned, unsigned, const void*)>("glDrawPixels");
}

Window::~Window() {
  glfwDestroyWindow(impl_->window);
  glfwTerminate();
}

void Window::Show(const Image& image) {
  impl_->width = image.width;
  impl_->height = image.height;
  int width = 1;
  int height = 1;
  glfwGetFramebufferSize(impl_->window, &width, &height);
  const Impl::Fit fit = impl_->CalcFit(std::max(width, 1), std::max(height, 1));
  impl_->viewport(0, 0, width, height);
  impl_->clear(kColorBuffer);
  impl_->pixel_store(kUnpackAlignment, 1);
  // Rows go downwards from the upper left corner.
  const auto x = static_cast<float>(2.0 * fit.left / width - 1.0);
  const auto y = static_cast<float>(1.0 - 2.0 * fit.top / height);
  constexpr float kInside = 0.999999F;  // a corner outside would not be drawn at all
  impl_->raster_pos(std::max(x, -kInside), std::min(y, kInside));
  impl_->pixel_zoom(static_cast<float>(fit.scale), static_cast<float>(-fit.scale));
  impl_->draw_pixels(image.width, image.height, kRgb, kUnsignedByte, image.rgb.data());
  glfwSwapBuffers(impl_->window);
}

void Window::SetTitle(const std::string& title) { glfwSetWindowTitle(impl_->window, title.c_str()); }

std::vector<InputEvent> Window::Poll(double seconds) {
  glfwWaitEventsTimeout(seconds);
  return std::exchange(impl_->events, {});
}

bool Window::is_closed() const { return glfwWindowShouldClose(impl_->window) != 0; }

}  // namespace dexcheck

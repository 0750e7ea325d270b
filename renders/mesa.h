#pragma once

// Mesa's off-screen OpenGL, loaded when the first context is made: with LLVM in it, it takes 60 ms of
// processor time to load, and most commands draw nothing.

#include <GL/osmesa.h>

namespace dexcheck {

/// The functions that are called here; MuJoCo finds its own.
struct Mesa {
// clang-format off
#define DEXCHECK_MESA(X)                                                                             \
  X(OSMesaCreateContextExt) X(OSMesaDestroyContext) X(OSMesaGetCurrentContext) X(OSMesaMakeCurrent)  \
  X(glBegin) X(glDeleteLists) X(glEnd) X(glEndList) X(glGenLists) X(glNewList) X(glNormal3dv)        \
  X(glNormal3f) X(glVertex3dv) X(glVertex3f)
// clang-format on
#define DEXCHECK_FUNCTION(name) decltype(&::name) name;
  DEXCHECK_MESA(DEXCHECK_FUNCTION)
#undef DEXCHECK_FUNCTION
};

/// @throws Error when the library is not there.
const Mesa& LoadMesa();

}  // namespace dexcheck

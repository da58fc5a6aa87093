#include "solver/output/vtk/vtk_module.hpp"

#include <doctest/doctest.h>

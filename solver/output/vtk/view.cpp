#include "solver/output/vtk/drawing.hpp"
#include "solver/output/vtk/silence.hpp"
#include "solver/output/vtk/view_frame.hpp"
#include "solver/output/vtk/vtk_module.hpp"

#include <X11/Xlib.h>
#include <vtkActor.h>
#include <vtkArrowSource.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkFloatArray.h>
#include <vtkGlyph3D.h>
#include <vtkInteractorStyle.h>
#include <vtkLookupTable.h>
#include <vtkMath.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTubeFilter.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fcntl.h>
#include <map>
#include <memory>
#include <stdexcept>
#include <sys/socket.h>
#include <unistd.h>

// The window of --view: solids coloured by their stress (plain without one), rigid bodies, wires,
// walls as glass, an arrow for each contact's force; a bar for each of the two with its unit. Keys:
// w wires, s shaded (VTK's own), t transparent, q closes.

namespace {

using namespace amontons;
using namespace amontons::vtk_module;
using Clock = std::chrono::steady_clock;

constexpr unsigned long kPollPeriod = 5; // between two reads of the stream [ms]
constexpr double kGlass = 0.2, kTransparent = 0.35;
constexpr double kArrow = 0.15; // of the scene's size: the largest force so far
constexpr int kLetters = 16;    // [pixels]

/// Left turns the view, middle shifts it, right or the wheel moves nearer; keys as VTK's own.
/// (VTK's trackball is in a library that brings MPI with it.)
class Mouse : public vtkInteractorStyle {
public:
    static Mouse* New();
    vtkTypeMacro(Mouse, vtkInteractorStyle);

    void OnLeftButtonDown() override { begin(Drag::turn); }
    void OnMiddleButtonDown() override { begin(Drag::shift); }
    void OnRightButtonDown() override { begin(Drag::nearer); }
    void OnLeftButtonUp() override { drag_ = Drag::none; }
    void OnMiddleButtonUp() override { drag_ = Drag::none; }
    void OnRightButtonUp() override { drag_ = Drag::none; }
    void OnMouseWheelForward() override { dolly(1.1); }
    void OnMouseWheelBackward() override { dolly(1 / 1.1); }
    void OnMouseMove() override
    {
        if (drag_ == Drag::none || !CurrentRenderer) return;
        const int* now = Interactor->GetEventPosition();
        const int* before = Interactor->GetLastEventPosition();
        const double x = now[0] - before[0], y = now[1] - before[1];
        vtkCamera* camera = CurrentRenderer->GetActiveCamera();
        if (drag_ == Drag::turn) {
            constexpr double kDegrees = 0.4; // a pixel
            camera->Azimuth(-kDegrees * x);
            camera->Elevation(-kDegrees * y);
            camera->OrthogonalizeViewUp();
        } else if (drag_ == Drag::shift) {
            const double height =
                2 * camera->GetDistance() *
                std::tan(0.5 * vtkMath::RadiansFromDegrees(camera->GetViewAngle()));
            const double pixel = height / CurrentRenderer->GetSize()[1];
            double up[3], right[3], towards[3], eye[3], at[3];
            camera->GetViewUp(up);
            camera->GetDirectionOfProjection(towards);
            vtkMath::Cross(towards, up, right);
            camera->GetPosition(eye);
            camera->GetFocalPoint(at);
            for (int i = 0; i < 3; ++i) {
                const double way = -pixel * (x * right[i] + y * up[i]);
                eye[i] += way;
                at[i] += way;
            }
            camera->SetPosition(eye);
            camera->SetFocalPoint(at);
        } else {
            return dolly(std::pow(1.01, y));
        }
        show();
    }

private:
    enum class Drag { none, turn, shift, nearer } drag_ = Drag::none;

    void begin(Drag drag)
    {
        drag_ = drag;
        FindPokedRenderer(Interactor->GetEventPosition()[0], Interactor->GetEventPosition()[1]);
    }
    void dolly(double factor)
    {
        FindPokedRenderer(Interactor->GetEventPosition()[0], Interactor->GetEventPosition()[1]);
        if (!CurrentRenderer) return;
        CurrentRenderer->GetActiveCamera()->Dolly(factor);
        show();
    }
    void show()
    {
        CurrentRenderer->ResetCameraClippingRange();
        Interactor->Render();
    }
};
vtkStandardNewMacro(Mouse);

/// A body in the window.
struct Shown {
    vtkNew<vtkPolyData> data;
    vtkNew<vtkPolyDataMapper> mapper;
    vtkNew<vtkActor> actor;
    vtkNew<vtkTubeFilter> tube; // of a wire
    std::int32_t kind = ViewShape::wall;
};

class ViewWindow {
public:
    ViewWindow(int stream, const char* title, bool stay) : stream_(stream), stay_(stay)
    {
        ::fcntl(stream_, F_SETFL, ::fcntl(stream_, F_GETFL) | O_NONBLOCK);
        renderer_->SetBackground(1, 1, 1);
        window_->SetNumberOfLayers(2);
        window_->AddRenderer(renderer_);
        over_->SetLayer(1); // forces lie between bodies: nothing hides them
        over_->SetActiveCamera(renderer_->GetActiveCamera());
        over_->InteractiveOff();
        window_->AddRenderer(over_);
        window_->SetSize(1000, 750);
        window_->SetWindowName(title);
        window_->SetMultiSamples(0); // software renders too
        caption_->GetTextProperty()->SetColor(kInk[0], kInk[1], kInk[2]);
        caption_->GetTextProperty()->SetFontSize(kLetters);
        caption_->SetPosition(10, 10);
        renderer_->AddActor2D(caption_);
        vtkNew<vtkArrowSource> arrow;
        arrows_->SetSourceConnection(arrow->GetOutputPort());
        arrows_->SetInputData(contacts_);
        arrows_->SetVectorModeToUseVector();
        arrows_->SetScaleModeToScaleByVector();
        arrows_->SetColorModeToColorByVector();
        arrow_mapper_->SetInputConnection(arrows_->GetOutputPort());
        arrow_actor_->SetMapper(arrow_mapper_);
        over_->AddActor(arrow_actor_);
        stress_table_->SetHueRange(0.62, 0.0); // blue to red
        stress_table_->SetSaturationRange(0.55, 0.75);
        stress_table_->Build();
        prepare_bar(stress_bar_, stress_table_, "von Mises\n[Pa]", 0.54);
        prepare_bar(force_bar_, table_of(make_force_scale(1)), "contact\nforce [N]", 0.06);
        vtkNew<Mouse> style;
        interactor_->SetRenderWindow(window_);
        interactor_->SetInteractorStyle(style);
        interactor_->Initialize();
        window_->Render();
    }

    void run()
    {
        vtkNew<vtkCallbackCommand> event;
        event->SetClientData(this);
        event->SetCallback([](vtkObject*, unsigned long id, void* self, void*) {
            auto& w = *static_cast<ViewWindow*>(self);
            if (id == vtkCommand::TimerEvent)
                w.show_newest();
            else if (std::string(w.interactor_->GetKeySym()) == "t")
                w.switch_transparent();
        });
        interactor_->AddObserver(vtkCommand::TimerEvent, event);
        interactor_->AddObserver(vtkCommand::KeyPressEvent, event);
        interactor_->CreateRepeatingTimer(kPollPeriod);
        if (::send(stream_, "R\n", 2, MSG_NOSIGNAL) < 0) return;
        interactor_->Start();
        char text[100];
        const double seconds = std::chrono::duration<double>(last_ - first_).count();
        const int n = std::snprintf(text, sizeof text, "F %ld %.6f\n", frames_, seconds);
        (void)!::send(stream_, text, static_cast<std::size_t>(n), MSG_NOSIGNAL);
    }

private:
    /// Takes what has come and shows the newest of it.
    void show_newest()
    {
        bool open = true;
        char buffer[1 << 16];
        for (ssize_t n = 0; open && (n = ::read(stream_, buffer, sizeof buffer)) != 0;) {
            if (n > 0)
                bytes_.append(buffer, static_cast<std::size_t>(n));
            else if (errno != EINTR)
                break;
        }
        ViewFrame frame;
        bool any = false;
        while (take_view_frame(bytes_, frame)) { // each, for triangles come only once
            for (const ViewShape& s : frame.shapes)
                show(s);
            any = true;
        }
        if (any) {
            show_stress();
            show_contacts(frame);
            caption_->SetInput(
                (frame.caption + "\nw wires   s shaded   t transparent   q close").c_str());
            if (frames_ == 0) {
                aim();
                first_ = Clock::now();
            }
            renderer_->ResetCameraClippingRange();
            window_->Render();
            ++frames_;
            last_ = Clock::now();
        }
        char more = 0;
        if (!any && ::recv(stream_, &more, 1, MSG_PEEK) == 0 && !stay_) interactor_->TerminateApp();
    }

    /// Wires in their vessel: along its thinnest side. Others: from above, from one side.
    void aim()
    {
        double box[6];
        renderer_->ComputeVisiblePropBounds(box);
        const double side[] = {box[1] - box[0], box[3] - box[2], box[5] - box[4]};
        vtkCamera* camera = renderer_->GetActiveCamera();
        const bool wires = std::any_of(shown_.begin(), shown_.end(), [](const auto& s) {
            return s.second.kind == ViewShape::wire;
        });
        const auto thinnest = std::min_element(side, side + 3) - side;
        double from[] = {1, -1.6, 0.8};
        if (wires)
            for (int i = 0; i < 3; ++i)
                from[i] = i == thinnest ? (i == 1 ? -1 : 1) : 0;
        camera->SetFocalPoint(0, 0, 0);
        camera->SetPosition(from);
        if (wires && thinnest == 2)
            camera->SetViewUp(0, 1, 0);
        else
            camera->SetViewUp(0, 0, 1);
        renderer_->ResetCamera();
        if (!wires) camera->Dolly(1.1);
    }

    void show(const ViewShape& s)
    {
        const auto [at, is_new] = shown_.try_emplace(s.name);
        Shown& shown = at->second;
        const vtkIdType n = static_cast<vtkIdType>(s.points.size() / 3);
        vtkNew<vtkFloatArray> places;
        places->SetNumberOfComponents(3);
        places->SetNumberOfTuples(n);
        std::copy(s.points.begin(), s.points.end(), places->GetPointer(0));
        vtkNew<vtkPoints> points;
        points->SetData(places);
        shown.data->SetPoints(points);
        if (s.kind == ViewShape::wire) {
            vtkNew<vtkCellArray> line;
            line->InsertNextCell(static_cast<int>(n));
            for (vtkIdType i = 0; i < n; ++i)
                line->InsertCellPoint(i);
            shown.data->SetLines(n > 1 ? line.Get() : vtkNew<vtkCellArray>().Get());
        } else if (!s.triangles.empty()) {
            vtkNew<vtkCellArray> cells;
            for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3) {
                const vtkIdType ids[] = {s.triangles[t], s.triangles[t + 1], s.triangles[t + 2]};
                cells->InsertNextCell(3, ids);
            }
            shown.data->SetPolys(cells);
        }
        if (s.kind == ViewShape::solid && s.values.empty())
            shown.data->GetPointData()->SetScalars(nullptr);
        if (s.values.size() == static_cast<std::size_t>(n)) {
            vtkNew<vtkFloatArray> values;
            values->SetNumberOfTuples(n);
            std::copy(s.values.begin(), s.values.end(), values->GetPointer(0));
            shown.data->GetPointData()->SetScalars(values);
            if (s.kind == ViewShape::solid)
                for (const float v : s.values)
                    stress_ = std::max(stress_, static_cast<double>(v));
        }
        shown.data->Modified();
        if (is_new) add(shown, s.kind);
        if (s.kind == ViewShape::solid) shown.mapper->SetScalarVisibility(!s.values.empty());
    }

    /// One range and one table for all solids, and its colour bar.
    void show_stress()
    {
        stress_table_->SetTableRange(0, stress_ > 0 ? stress_ : 1);
        for (auto& [name, shown] : shown_)
            if (shown.kind == ViewShape::solid)
                shown.mapper->SetScalarRange(0, stress_ > 0 ? stress_ : 1);
        stress_bar_->SetVisibility(stress_ > 0);
    }

    /// A colour bar at the right edge, at this height of the window.
    void prepare_bar(vtkScalarBarActor* bar, vtkLookupTable* table, const char* title,
                     double height)
    {
        bar->SetLookupTable(table);
        bar->SetTitle(title);
        bar->SetNumberOfLabels(5);
        bar->SetLabelFormat("%.4g"); // 1000, not 1e+03
        bar->SetPosition(0.88, height);
        bar->SetWidth(0.1);
        bar->SetHeight(0.4);
        bar->SetUnconstrainedFontSize(true);
        for (vtkTextProperty* text : {bar->GetLabelTextProperty(), bar->GetTitleTextProperty()}) {
            text->SetFontSize(kLetters - 2);
            text->SetColor(kInk[0], kInk[1], kInk[2]);
            text->BoldOff();
            text->ItalicOff();
            text->ShadowOff();
        }
        bar->SetVisibility(false);
        over_->AddActor2D(bar);
    }

    void add(Shown& shown, std::int32_t kind)
    {
        shown.kind = kind;
        if (kind == ViewShape::wire) {
            shown.tube->SetInputData(shown.data);
            shown.tube->SetVaryRadiusToVaryRadiusByAbsoluteScalar();
            shown.tube->SetNumberOfSides(12);
            shown.mapper->SetInputConnection(shown.tube->GetOutputPort());
        } else {
            shown.mapper->SetInputData(shown.data);
        }
        vtkProperty* property = shown.actor->GetProperty();
        shown.mapper->SetScalarVisibility(kind == ViewShape::solid);
        if (kind == ViewShape::solid) {
            shown.mapper->SetLookupTable(stress_table_);
            shown.mapper->UseLookupTableScalarRangeOff();
        }
        if (kind == ViewShape::wall) {
            property->SetColor(0.69, 0.35, 0.31);
            property->SetOpacity(kGlass);
        } else if (kind == ViewShape::wire) {
            property->SetColor(0.1, 0.2, 0.4);
        } else {
            property->SetColor(0.75, 0.75, 0.72);
        }
        shown.actor->SetMapper(shown.mapper);
        renderer_->AddActor(shown.actor);
    }

    void show_contacts(const ViewFrame& frame)
    {
        const vtkIdType n = static_cast<vtkIdType>(frame.contacts.size() / 6);
        vtkNew<vtkPoints> points;
        vtkNew<vtkFloatArray> force;
        force->SetNumberOfComponents(3);
        for (vtkIdType i = 0; i < n; ++i) {
            const float* c = frame.contacts.data() + 6 * i;
            points->InsertNextPoint(c);
            force->InsertNextTuple(c + 3);
            largest_ = std::max(largest_, std::sqrt(double(c[3]) * c[3] + double(c[4]) * c[4] +
                                                    double(c[5]) * c[5]));
        }
        contacts_->SetPoints(points);
        contacts_->GetPointData()->SetVectors(force);
        contacts_->Modified();
        if (frames_ == 0 || !(size_ > 0)) {
            double box[6];
            renderer_->ComputeVisiblePropBounds(box);
            size_ = std::hypot(box[1] - box[0], box[3] - box[2], box[5] - box[4]);
        }
        arrows_->SetScaleFactor(largest_ > 0 ? kArrow * size_ / largest_ : 0);
        arrow_mapper_->SetScalarRange(0, largest_ > 0 ? largest_ : 1);
        const vtkSmartPointer<vtkLookupTable> table = table_of(make_force_scale(largest_));
        table->SetTableRange(0, largest_ > 0 ? largest_ : 1);
        arrow_mapper_->SetLookupTable(table);
        force_bar_->SetLookupTable(table);
        force_bar_->SetVisibility(largest_ > 0);
        arrow_actor_->SetVisibility(n > 0);
    }

    void switch_transparent()
    {
        transparent_ = !transparent_;
        for (auto& [name, shown] : shown_)
            if (shown.kind == ViewShape::solid || shown.kind == ViewShape::rigid)
                shown.actor->GetProperty()->SetOpacity(transparent_ ? kTransparent : 1);
        window_->Render();
    }

    int stream_;
    bool stay_, transparent_ = false;
    std::string bytes_;
    vtkNew<vtkRenderer> renderer_, over_;
    vtkNew<vtkRenderWindow> window_;
    vtkNew<vtkRenderWindowInteractor> interactor_;
    vtkNew<vtkTextActor> caption_;
    vtkNew<vtkPolyData> contacts_;
    vtkNew<vtkGlyph3D> arrows_;
    vtkNew<vtkPolyDataMapper> arrow_mapper_;
    vtkNew<vtkActor> arrow_actor_;
    vtkNew<vtkLookupTable> stress_table_;
    vtkNew<vtkScalarBarActor> stress_bar_, force_bar_;
    std::map<std::string, Shown> shown_;
    double size_ = 0, largest_ = 0, stress_ = 0;
    long frames_ = 0;
    Clock::time_point first_{}, last_{};
};

} // namespace

int amontons_vtk_view(int stream, const char* title, int stay, char* message, int message_size)
{
    try {
        const Silence silence;
        // VTK itself ends the process where there is no display. Held while the window is there: a
        // server may start anew when its last client leaves.
        const std::unique_ptr<Display, int (*)(Display*)> display(XOpenDisplay(nullptr),
                                                                  XCloseDisplay);
        if (!display) throw std::runtime_error("no display to open a window on");
        ViewWindow(stream, title, stay != 0).run();
        return 0;
    } catch (const std::exception& error) {
        if (message && message_size > 0)
            std::snprintf(message, static_cast<std::size_t>(message_size), "%s", error.what());
        return 1;
    }
}

"""The verbs: one module per subject."""

from .. import viewport
from ..handlers import unwatch, watch
from ..job import Job
from ..registration import register_factory
from . import (
    align,
    align_selected,
    check,
    choose_target,
    clear,
    conformal_transfer,
    discs,
    example,
    flatten,
    heat_map,
    join_copy,
    live,
    mend,
    point_pairs,
    select_unmatched,
    side_by_side,
    swap,
    transfer,
    try_expressions,
    use_selected,
    wrap,
)

_register, _unregister = register_factory(
    (
        example.MOBIUS_OT_load_example,
        example.MOBIUS_OT_remove_example,
        example.MOBIUS_OT_guide,
        check.MOBIUS_OT_check,
        mend.MOBIUS_OT_mend,
        flatten.MOBIUS_OT_flatten,
        swap.MOBIUS_OT_swap,
        use_selected.MOBIUS_OT_use_selected,
        join_copy.MOBIUS_OT_join_copy,
        align.MOBIUS_OT_align,
        align_selected.MOBIUS_OT_align_selected,
        choose_target.MOBIUS_OT_choose_target,
        transfer.MOBIUS_OT_transfer,
        try_expressions.MOBIUS_OT_try_expressions,
        wrap.MOBIUS_OT_wrap,
        live.MOBIUS_OT_live,
        point_pairs.MOBIUS_OT_add_pair,
        point_pairs.MOBIUS_OT_bend_through_pairs,
        point_pairs.MOBIUS_OT_remove_pair,
        point_pairs.MOBIUS_OT_select_pair,
        select_unmatched.MOBIUS_OT_select_unmatched,
        conformal_transfer.MOBIUS_OT_conformal_transfer,
        heat_map.MOBIUS_OT_heat_map,
        discs.MOBIUS_OT_show_discs,
        side_by_side.MOBIUS_OT_side_by_side,
        side_by_side.MOBIUS_OT_end_side_by_side,
        clear.MOBIUS_OT_clear,
    )
)


def _forget(*_: object) -> None:
    align.forget_last()
    viewport.forget_views()
    _forget_refused()


def _forget_refused(*_: object) -> None:
    Job.refused = None  # what it was about may be back


_HANDLERS = (("load_post", _forget), ("undo_post", _forget_refused), ("redo_post", _forget_refused))


def register() -> None:
    """Register the operators."""
    _register()
    watch(*_HANDLERS)


def unregister() -> None:
    """Undo `register`."""
    unwatch(*_HANDLERS)
    _forget()
    _unregister()

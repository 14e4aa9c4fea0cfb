//! Stories: one file per thing that went wrong and was mended, named after it.

mod closing_contacts_threw_a_heap_up;

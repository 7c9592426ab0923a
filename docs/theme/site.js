// Accessibility that the theme leaves out: landmarks, attributes, regions that scroll, and columns without a heading.
document.addEventListener("DOMContentLoaded", () => {
    document.querySelector("#menu-bar")?.setAttribute("role", "banner");
    for (const name of ["aria-label", "aria-expanded", "aria-controls"]) {
        document.querySelector("#sidebar-toggle")?.removeAttribute(name); // a label can have none of them
    }
    document.querySelector("#searchbar")?.setAttribute("aria-label", "Search");
    for (const [index, nav] of document.querySelectorAll("nav.nav-wrapper, nav.nav-wide-wrapper").entries()) {
        nav.setAttribute("aria-label", `Previous and next page ${index + 1}`);
    }
    for (const cell of document.querySelectorAll("th")) {
        if (!cell.textContent.trim()) {
            const plain = document.createElement("td");
            cell.replaceWith(plain);
        }
    }
    for (const region of document.querySelectorAll("main pre > code, main table, main .table-wrapper")) {
        if (region.scrollWidth > region.clientWidth) {
            region.setAttribute("tabindex", "0");
        }
    }
});
